"""Figures as text and as files."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import matplotlib as mpl
import pytest
from matplotlib.figure import Figure

from ulna.base import UlnaError
from ulna.plot import Curve, plot_curves, save_figure, svg_text


def _figure() -> Figure:
    curves = [Curve(label=name, times=[0.0, 1.0], values=[0.0, 1.0]) for name in ("a", "b")]
    return plot_curves(curves, quantity="angle", unit="rad", title="Ramp")


def test_an_svg_is_one_element_without_date_or_outside_reference() -> None:
    text = svg_text(_figure())
    root = ET.fromstring(text)  # noqa: S314 (our own text)
    assert root.tag.endswith("svg")
    assert "metadata" not in text
    assert "<image" not in text


def test_the_same_figure_gives_the_same_text() -> None:
    assert svg_text(_figure()) == svg_text(_figure())


def test_a_prefix_keeps_the_identifiers_of_two_figures_apart() -> None:
    def identifiers(prefix: str) -> set[str]:
        root = ET.fromstring(svg_text(_figure(), prefix=prefix))  # noqa: S314 (our own text)
        found = {node.attrib["id"] for node in root.iter() if "id" in node.attrib}
        used = {v[1:] for node in root.iter() for k, v in node.attrib.items() if k.endswith("href") and v[0] == "#"}
        assert used <= found
        return found

    assert not identifiers("one-") & identifiers("two-")


@pytest.mark.parametrize(("suffix", "head"), [("svg", b"<?xml"), ("png", b"\x89PNG"), ("pdf", b"%PDF")])
def test_the_ending_names_the_format(tmp_path: Path, suffix: str, head: bytes) -> None:
    path = save_figure(_figure(), tmp_path / f"ramp.{suffix}")
    assert path.read_bytes().startswith(head)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_an_unknown_ending_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(UlnaError, match=r"'\.xyz' names no known format"):
        save_figure(_figure(), tmp_path / "ramp.xyz")
    assert list(tmp_path.iterdir()) == []


def test_a_missing_folder_is_one_clear_error(tmp_path: Path) -> None:
    with pytest.raises(UlnaError, match="cannot be written"):
        save_figure(_figure(), tmp_path / "missing" / "ramp.svg")


def test_a_place_taken_by_a_folder_leaves_nothing_behind(tmp_path: Path) -> None:
    (tmp_path / "ramp.svg").mkdir()
    with pytest.raises(UlnaError, match="cannot be written"):
        save_figure(_figure(), tmp_path / "ramp.svg")
    assert [p.name for p in tmp_path.iterdir()] == ["ramp.svg"]


def test_drawing_leaves_the_global_settings_alone() -> None:
    before = dict(mpl.rcParams)
    svg_text(_figure())
    assert dict(mpl.rcParams) == before
