"""The report on a plant: complete, one file, and nothing of what a user wrote becomes markup or a formula."""

from __future__ import annotations

import math
import re
from html import unescape
from html.parser import HTMLParser

import pytest
from terminal import refused, ulna, written

from ulna.base import SimulationError, Verdict
from ulna.design import analyse, controller_for
from ulna.loop import (
    Amplifier,
    Deadline,
    EndStop,
    Hardware,
    Jitter,
    Loop,
    MeasurementNoise,
    MissedSamples,
    Quantiser,
    SafeOutput,
    Saturation,
    SlewLimit,
)
from ulna.page import report_page, report_text
from ulna.page.report.formulas import numbers
from ulna.page.report.hardware import hardware_rows
from ulna.page.report.quantities import number_text, seconds, with_unit
from ulna.plants import model
from ulna.program import Plain
from ulna.system import system_from_mapping

HOSTILE = "</script><script>alert(1)</script> \"'`${alert(1)}<b> $x_1$"
_QUESTIONS = ("relative_degree", "involutive")


def _spring(**more):
    return system_from_mapping(
        {
            "name": "spring",
            "parameters": {"k": {"value": 2, "text": "stiffness"}},
            "states": {"q": {"equation": "p"}, "p": "-k*sin(q) - p + u"},
            "inputs": {"u": {}},
            "outputs": {"y": "q"},
            **more,
        }
    )


class _Reader(HTMLParser):
    """Elements of a page, the pages inside it, and its text."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.frames: list[dict[str, str | None]] = []
        self.links: list[str] = []
        self.words: list[str] = []
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.links += [value or "" for name, value in attrs if name in ("src", "href", "xlink:href")]
        if tag == "iframe":
            self.frames.append(dict(attrs))

    def handle_data(self, data: str) -> None:
        self.words.append(data)

    @property
    def text(self) -> str:
        return re.sub(r"\s+", " ", " ".join(self.words))


def _short(plant):
    return analyse(plant, questions=_QUESTIONS)


def test_a_loop_with_hardware_has_every_section_on_one_page():
    plant = _spring()
    chip = Hardware(period=0.01, saturation=Saturation(lower=-2, upper=2), arithmetic=Plain())
    loop = Loop(plant=plant, controller=controller_for(plant, law=[-3, -4], observer=[-8, -9]), hardware=chip)
    claim = Verdict.undecided("it converges from <here>", reason="no time")
    page = _Reader(report_text(loop, analysis=_short(plant), proof=claim, initial={"q": 0.5}))
    for title in ("In short", "The plant", "Verdicts", "The controller", "A run", "Proof", "Drive it by hand"):
        assert title in page.text
    for said in ("controller form", "observer form", "with the hardware", "without the hardware", "stiffness",
                 "settles (2 %)", "relative degree", "it converges from <here>", "loop at rest"):  # fmt: skip
        assert said in page.text
    assert page.tags.count("math") > 5
    assert page.tags.count("svg") == 2
    # Nothing but places in the page itself; the live page runs apart, under a policy of its own.
    assert all(link.startswith("#") for link in page.links)
    (frame,) = page.frames
    assert "allow-same-origin" not in (frame["sandbox"] or "")
    assert "default-src 'none'" in unescape(frame["srcdoc"] or "")
    assert "script" not in page.tags


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.1 + 0.2, "0.3"), (2290.0, "2290"), (9.8e-5, "9.8·10⁻⁵"), (1e9, "10⁹"), (-17.64, "−17.64"), (0.0, "0"),
     (123456.7, "123457"), (math.nan, "–")],
)  # fmt: skip
def test_numbers_are_written_as_people_write_them(value: float, text: str) -> None:
    assert number_text(value) == text
    assert [with_unit(2.0, "N*m^2/A^2"), seconds(2.5e-4), seconds(0.5)] == ["2 N·m²/A²", "250 µs", "0.5 s"]
    assert numbers([-8, -2 - 3.464j, -2 + 3.464j, 1e-12j - 3]) == "−2 ± 3.464j, −3, −8"


def test_the_hardware_is_told_in_words_with_its_units():
    plant = model("mass_spring_damper")
    chip = Hardware(
        period=2.5e-4, delay=1e-3, sensors=Quantiser.encoder(bits=12), noise={"p": MeasurementNoise(std=1e-5)},
        saturation=Saturation(lower=-24, upper=24), slew=SlewLimit(rate=2290.0),
        drive=Amplifier(lower="-cell", upper="cell - ohms*s", numbers={"cell": 12.5, "ohms": 0.1 + 0.2}),
        clock=(Jitter(width=1e-5), MissedSamples(probability=0.01)),
        end_stops=(EndStop(position="p", velocity="s", lower=-1.5, restitution=0.3),),
        deadline=Deadline(lateness=1e-4, reaction=SafeOutput({"u": 0.0})),
    )  # fmt: skip
    told = dict(hardware_rows(Loop(plant=plant, controller=controller_for(plant, law=[-3, -4]), hardware=chip)))
    assert told["processor"] == "computes once every 250 µs, in double precision with fused multiply-add"
    assert told["delay"] == "1 ms from a sample to the new input"
    assert told["sensor of p"] == "steps of 0.001534 m"
    assert told["limits of u"] == "within ±24 N"
    assert told["slew of u"] == "at most 2290 N/s"
    assert told["noise of p"] == "standard deviation 10⁻⁵ m"
    assert "with cell = 12.5; ohms = 0.3" in told["drive of u"]
    assert told["end stop"] == "p from −1.5 m on, and 30 % of the speed comes back"
    assert told["deadline"] == "a call more than 100 µs late: the safe output u = 0 is commanded"
    assert not [text for text in told.values() if "(" in text and "=" in text.partition("(")[2]]


def test_a_plant_alone_moves_and_one_without_values_is_still_told():
    plant = _spring()
    alone = _Reader(report_text(plant, analysis=_short(plant), horizon=1.0))
    assert "The controller" not in alone.text
    assert len(alone.frames) == 1
    symbolic = _spring(parameters={"k": {}})
    still = _Reader(report_text(symbolic, analysis=_short(symbolic)))
    assert "There is no run: parameters without a value: k." in still.text
    assert not still.frames


def test_what_a_user_wrote_stays_text():
    plant = _spring(
        name=HOSTILE,
        text=HOSTILE,
        parameters={"k": {"value": 2, "text": HOSTILE, "source": HOSTILE}},
        states={"q": {"equation": "p", "text": HOSTILE}, "p": {"equation": "-k*sin(q) - p + u", "text": HOSTILE}},
    )
    html = report_text(plant, analysis=_short(plant), horizon=1.0)
    page = _Reader(html)
    assert "script" not in page.tags
    assert "b" not in page.tags
    assert HOSTILE in page.text
    assert page.text.count(HOSTILE) >= 5
    # The page inside has its own scripts and no other.
    (frame,) = page.frames
    assert "alert(1)</script>" not in (frame["srcdoc"] or "")


def test_a_place_that_cannot_be_written_leaves_nothing(tmp_path):
    with pytest.raises(SimulationError, match="its folder does not exist"):
        report_page(_spring(), out=tmp_path / "nowhere" / "page.html")
    folder = tmp_path / "page.html"
    folder.mkdir()
    with pytest.raises(SimulationError, match="cannot be written"):
        report_page(_spring(), out=folder, analysis=_short(_spring()), horizon=1.0)
    assert list(tmp_path.iterdir()) == [folder]
    assert not list(folder.iterdir())


def test_the_command_writes_the_page_or_says_why_not(tmp_path):
    plant = written(
        'name = "decay"\n[states]\nx = "-x**3 + u"\n[inputs]\nu = {}\n[outputs]\ny = "x"\n', tmp_path / "decay.toml"
    )
    out = tmp_path / "page.html"
    done = ulna(
        "report", plant, "--controller-poles=-2", "--limit", "4", "--initial", "1", "--prove", "--out", str(out)
    )
    assert done.exit_code == 0, done.output
    page = _Reader(out.read_text())
    assert "Proof" in page.text
    assert "with the hardware" in page.text
    assert "its folder does not exist" in refused("report", plant, "--out", str(tmp_path / "no" / "page.html"))
    assert "they exclude each other" in refused("report", plant, "--alone", "--controller-poles=-2", "--out", str(out))
