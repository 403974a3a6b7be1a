"""The page in a real browser: what hands do to it, and what it must never do."""

from __future__ import annotations

from contextlib import contextmanager

import pytest
import sympy as sp
from browser import Opened, chromium

from ulna import simulate
from ulna.base import SimulationError
from ulna.design import analyse
from ulna.loop import Hardware, Loop, Saturation
from ulna.page import SetPointSource, report_text, studio
from ulna.program import Plain
from ulna.system import Signal, System, system_from_mapping

HOSTILE = "</script><script>alert(1)</script> \"'`${alert(1)}<b>"


def _pendulum(**more):
    return system_from_mapping(
        {
            "name": "pendulum",
            "parameters": {"m": {"value": 1, "range": [0, 4], "text": "load"}, "l": 1},
            "states": {"th": {"equation": "om", "text": "angle"}, "om": "u/(l**2*(m + 1)) - 9.8*sin(th)/l - om/2"},
            "inputs": {"u": {}},
            "outputs": {"y": "th"},
            "picture": {"kind": "arm", "angle": "th", "load": "m", "zero": "down", "turns": "anticlockwise"},
            **more,
        }
    )


def _law(gain):
    return system_from_mapping(
        {
            "name": f"law {gain}",
            "inputs": {"th": {}, "om": {}, "y_ref": {}},
            "outputs": {"u": f"20*sin(th) + {gain}*(y_ref - th) - {gain}/3*om"},
        }
    )


@pytest.fixture(scope="module")
def browser():
    with chromium() as found:
        yield found


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """Two controllers of a pendulum side by side, on a processor, with the bits of `simulate`."""
    chip = Hardware(period=0.01, saturation=Saturation(lower=-60, upper=60), arithmetic=Plain())
    loops = [Loop(plant=_pendulum(), controller=_law(gain), hardware=chip) for gain in (40, 15)]
    return studio(*loops, out=tmp_path_factory.mktemp("pages") / "arm.html", check=0.5)


@contextmanager
def opened(browser, path, fragment="", **settings):
    shown = Opened(browser, path, fragment, **settings)
    yield shown
    shown.context.close()
    assert shown.complaints == []


def _box(shown, name):
    return shown.page.locator(name).bounding_box()


def test_it_runs_without_a_complaint_and_with_the_bits_of_simulate(browser, arm):
    with opened(browser, arm) as shown:
        shown.until("ulnaPage.clock.time > 0.3")
        assert "✓ same bits" in shown.page.inner_text("#badge")
        assert shown.page.locator("#curves canvas").count() == 3
        assert shown.value("ulnaPage.record.length") > 20


def test_a_spoiled_recording_turns_the_badge_red(browser, arm, tmp_path):
    text = arm.read_text(encoding="utf-8")
    spoiled = tmp_path / "spoiled.html"
    spoiled.write_text(text.replace('"sum":', '"sum":1', 1), encoding="utf-8")
    with opened(browser, spoiled) as shown:
        assert "✗ not the run of simulate" in shown.page.inner_text("#badge")
        assert "bad" in str(shown.page.get_attribute("#badge", "class"))


def test_a_hand_drags_the_plant_and_the_set_point(browser, arm):
    with opened(browser, arm) as shown:
        shown.page.click("#play")
        shown.value("ulnaPage.stage.draw()")
        [x, y] = shown.value("ulnaPage.stage.handles[0].at")
        box = _box(shown, "#stage")
        shown.page.mouse.move(box["x"] + x, box["y"] + y)
        shown.page.mouse.down()
        shown.page.mouse.move(box["x"] + x + 60, box["y"] + y - 60, steps=3)
        shown.page.mouse.up()
        assert shown.value("ulnaPage.input('y_ref')") > 0.2
        [x, y] = shown.value("ulnaPage.stage.kind.layout(ulnaPage.stage.handles[0].box, ulnaPage.stage.view(0)).hand")
        shown.page.mouse.move(box["x"] + x, box["y"] + y)
        shown.page.mouse.down()
        shown.page.mouse.move(box["x"] + x - 80, box["y"] + y - 10, steps=3)
        shown.until("Math.abs(ulnaPage.loops[0].input('push_om')) > 1")
        shown.page.mouse.up()
        assert shown.value("ulnaPage.loops[1].input('push_om')") == 0


def test_a_finger_drags_the_set_point_and_the_plant_and_does_not_scroll(browser, arm):
    with opened(browser, arm, viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True) as shown:
        shown.page.tap("#play")
        finger = shown.context.new_cdp_session(shown.page)

        def touch(kind, *at):
            points = [{"x": at[0], "y": at[1]}] if at else []
            finger.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

        shown.page.locator("#stage").scroll_into_view_if_needed()
        before = shown.value("scrollY")
        for what, moved in (("ulnaPage.stage.handles[0].at", "ulnaPage.input('y_ref') > 0.2"),
                            ("ulnaPage.stage.kind.layout(ulnaPage.stage.handles[0].box, ulnaPage.stage.view(0)).hand",
                             "Math.abs(ulnaPage.loops[0].input('push_om')) > 1")):  # fmt: skip
            shown.value("ulnaPage.stage.draw()")
            [x, y] = shown.value(what)
            box = _box(shown, "#stage")
            touch("touchStart", box["x"] + x, box["y"] + y)
            touch("touchMove", box["x"] + x + 20, box["y"] + y - 40)
            touch("touchMove", box["x"] + x + 40, box["y"] + y - 70)
            shown.until(moved)
            touch("touchEnd")
        shown.until("ulnaPage.loops[0].input('push_om') === 0")
        assert shown.value("scrollY") == before


def test_everything_goes_by_keys_alone(browser, arm):
    with opened(browser, arm) as shown:
        press = shown.page.keyboard.press
        shown.page.focus("#stage")
        press("Space")
        assert shown.page.inner_text("#play") == "Play"
        before = shown.value("ulnaPage.clock.time")
        press(".")
        assert shown.value("ulnaPage.clock.time") > before
        press("ArrowRight")
        assert shown.value("ulnaPage.input('y_ref')") > 0
        press("l")
        assert shown.value("ulnaPage.parameter('m', 0)") == 0
        shown.page.focus("#plane")
        press("ArrowRight")
        press("Enter")
        assert "Started from" in shown.page.inner_text("#said")
        press("r")
        assert shown.value("ulnaPage.clock.time") == 0
        shown.page.locator("#pushes .hold").first.focus()
        shown.page.keyboard.down("Enter")
        assert shown.value("ulnaPage.loops[0].input('push_om')") < 0
        shown.page.keyboard.up("Enter")
        assert shown.value("ulnaPage.loops[0].input('push_om')") == 0


def test_a_held_key_moves_the_set_point_until_it_is_let_go_or_moved_by_hand(browser, tmp_path):
    place, grip = (sp.Symbol(name, real=True) for name in ("place", "grip"))
    lever = System(
        name="lever", states=(Signal(name="place"),), rates=(place + grip / 50,), inputs=(Signal(name="grip"),),
        outputs=(Signal(name="y_ref"), Signal(name="shown")), readouts=(place, grip), period=sp.Rational(1, 100),
    )  # fmt: skip
    source = SetPointSource(system=lever, text="the lever moves it", held={"grip": "g"}, starts={"place": "y_ref"})
    loop = Loop(plant=_pendulum(), controller=_law(40), hardware=Hardware(period=0.01, arithmetic=Plain()))
    path = studio(loop, out=tmp_path / "lever.html", source=source, check=0, initial={"th": 0, "om": 0})
    with opened(browser, path) as shown:
        shown.page.keyboard.down("g")
        shown.until("ulnaPage.input('y_ref') > 0.2")
        shown.page.keyboard.up("g")
        held = shown.value("ulnaPage.input('y_ref')")
        shown.until("ulnaPage.loops[0].get('shown') === 0")
        assert shown.page.is_checked("#held input[type=checkbox]")
        shown.page.focus("#stage")
        shown.page.keyboard.press("ArrowLeft")
        assert not shown.page.is_checked("#held input[type=checkbox]")
        assert "by hand" in shown.page.inner_text("#said")
        present = shown.value("ulnaPage.input('y_ref')")
        shown.until(f"Math.abs(ulnaPage.loops[0].get('y_ref') - {present}) < 1e-9")
        assert 0 < present < held + 0.2


def test_it_goes_back_and_its_address_brings_the_state_back(browser, arm):
    with opened(
        browser, arm, "#in.y_ref=0.5&p.0.plant.m=2&speed=0.5&x.th=0.25&in.y_ref=NaN&p.9.x.y=1&nonsense"
    ) as shown:
        assert shown.value("[ulnaPage.input('y_ref'), ulnaPage.parameter('m', 1), ulnaPage.clock.speed]") == [
            0.5,
            2,
            0.5,
        ]
        assert shown.value("ulnaPage.record.columns[0].th[0]") == 0.25
        shown.until("ulnaPage.clock.time > 0.4")
        before = shown.value("ulnaPage.clock.time")
        shown.page.click("#back-1")
        assert shown.value("ulnaPage.clock.time") < before
        with shown.page.expect_download() as taken:
            shown.page.click("#csv")
        lines = taken.value.path().read_text(encoding="utf-8").splitlines()
        assert lines[0].startswith("time,law 40: th,law 40: om")
        assert len(lines) > 10


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_telephone_shows_it_whole_and_readable(browser, arm, scheme):
    from axe_playwright_python.sync_playwright import Axe

    settings = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "color_scheme": scheme}
    with opened(browser, arm, reduced_motion="reduce", **settings) as shown:
        assert shown.value("document.documentElement.scrollWidth") <= 390
        assert shown.page.inner_text("#play") == "Play"  # reduced motion: it stands still
        assert shown.page.is_visible("#still")
        for fold in shown.page.locator("details > summary").all():
            fold.tap()
        assert shown.value("document.documentElement.scrollWidth") <= 390
        found = Axe().run(shown.page).response["violations"]
        assert [
            (each["id"], each["nodes"][0]["html"]) for each in found if each["impact"] in ("serious", "critical")
        ] == []


def test_names_stay_text(browser, tmp_path):
    plant = _pendulum(name=HOSTILE, text=HOSTILE, picture={})
    path = studio(plant, out=tmp_path / "hostile.html", names=[HOSTILE], check=0)
    with opened(browser, path) as shown:
        assert shown.page.inner_text("h1") == HOSTILE
        assert shown.value("document.scripts.length") == 5
        assert "no controller" in shown.page.inner_text(".note >> nth=0")
        shown.until("ulnaPage.clock.time > 0.1")


def test_a_run_that_blows_up_says_so_and_starts_again(browser, tmp_path):
    plant = system_from_mapping({"name": "runaway", "states": {"x": "x**2 + 1"}, "outputs": {"y": "x"}})
    path = studio(plant, out=tmp_path / "runaway.html", initial={"x": 1}, check=0)
    with opened(browser, path) as shown:
        shown.page.wait_for_selector("#ended:not([hidden])")
        assert "Start it again" in shown.page.inner_text("#ended-text")
        shown.page.click("#ended-restart")
        shown.page.wait_for_selector("#ended", state="hidden")


def test_a_hidden_tab_goes_on_where_it_was_and_does_not_catch_up_in_a_leap(browser, arm):
    with opened(browser, arm) as shown:
        shown.until("ulnaPage.clock.time > 0.1")
        # A browser gives a hidden tab no frames, and the first one afterwards as if nothing had been.
        shown.page.evaluate("""() => {
            const real = requestAnimationFrame;
            window.requestAnimationFrame = (frame) => { window.show = () => {
                window.requestAnimationFrame = real; document.dispatchEvent(new Event("visibilitychange")); real(frame);
            }; };
        }""")
        shown.until("window.show")
        before = shown.value("[ulnaPage.clock.time, ulnaPage.count]")
        shown.page.wait_for_timeout(1200)
        assert shown.value("[ulnaPage.clock.time, ulnaPage.count]") == before
        after = shown.value("(show(), new Promise((done) => requestAnimationFrame(() => done("
                            "[ulnaPage.clock.time, ulnaPage.count]))))")  # fmt: skip
        # A frame shows 0.1 s at most, however long the last one is ago; and it moves on from there.
        assert after[0] - before[0] <= 0.1 * (after[1] - before[1]) + 1e-9
        assert after[0] - before[0] < 0.6
        shown.until(f"ulnaPage.clock.time > {after[0]} + 0.1")
        assert shown.value("ulnaPage.clock.frame(performance.now() + 1e5)") < 100


def test_the_page_inside_a_report_runs_under_the_policy_of_both(browser, tmp_path):
    path, complaints = tmp_path / "report.html", []
    plant = _pendulum()
    loop = Loop(plant=plant, controller=_law(40))
    path.write_text(report_text(loop, analysis=analyse(plant, questions=["relative_degree"]), horizon=1.0), "utf-8")
    page = browser.new_page()
    page.on("console", lambda m: complaints.append(m.text) if m.type in ("error", "warning") else None)
    page.on("request", lambda r: None if r.url.startswith("file:") else complaints.append(r.url))
    page.goto(path.as_uri())
    place = page.locator("iframe")
    place.scroll_into_view_if_needed()
    frame = place.element_handle().content_frame()
    frame.wait_for_selector("body.ready")
    assert frame.inner_text("#play") == "Play"  # it stands still until it is asked
    frame.click("#play")
    frame.wait_for_function("() => ulnaPage.clock.time > 0.2")
    page.close()
    assert complaints == []


def test_a_recorded_run_is_sought_and_cannot_be_pushed(browser, tmp_path):
    chip = Hardware(period=0.01, saturation=Saturation(lower=-60, upper=60))
    run = simulate(Loop(plant=_pendulum(), controller=_law(40), hardware=chip), [0.5, 0.0], 2.0, inputs={"y_ref": 0.2})
    with opened(browser, studio(run, out=tmp_path / "run.html", paused=True), "#p.0.plant.m=3") as shown:
        assert shown.page.locator("#pushes .hold, #parameters input, #set-points input").count() == 0
        assert "not changed" in shown.page.inner_text(".note >> nth=0")
        shown.page.keyboard.press(".")
        assert shown.value("ulnaPage.loops[0].get('th')") == run.states[1, 0]
        shown.value("ulnaPage.seek(1.5)")
        row = shown.value("ulnaPage.loops[0].samples")
        assert abs(run.times[row] - 1.5) < 0.011
        assert shown.value("ulnaPage.loops[0].get('om')") == run.states[row, 1]
        assert shown.value("ulnaPage.figures.state[0].peak") == abs(run.inputs[: row + 1]).max()
        assert shown.value("ulnaPage.record.length") == len(run.times)
        shown.page.click("#play")
        shown.until("!document.getElementById('ended').hidden")
        assert "reached the final time" in shown.page.inner_text("#ended-text")


def test_a_recorded_run_has_no_second_one_and_no_other_inputs(tmp_path):
    run = simulate(_pendulum(), [0.5, 0.0], [0.0, 0.1], inputs={"u": 0.0})
    with pytest.raises(SimulationError, match="page of its own"):
        studio(run, _pendulum(), out=tmp_path / "a.html")
    with pytest.raises(SimulationError, match="has its own"):
        studio(run, inputs={"u": 1.0}, out=tmp_path / "a.html")
