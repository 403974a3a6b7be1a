"""A figure as SVG text or as a file, the same bytes for the same figure."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_pdf import FigureCanvasPdf
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from ulna.base import UlnaError, whole_file

FORMATS: Final = ("svg", "png", "pdf")
"""File name endings that `save_figure` writes."""

_CANVASES: Final = {"svg": FigureCanvasSVG, "png": FigureCanvasAgg, "pdf": FigureCanvasPdf}

# Letters as paths look the same everywhere; the salt makes the identifiers inside an SVG the same on every run.
_SETTINGS: Final[dict[Any, Any]] = {"svg.fonttype": "path", "svg.hashsalt": "ulna", "path.simplify_threshold": 0.2}


def svg_text(figure: Figure, *, prefix: str = "") -> str:
    """Return the figure as one `<svg>` element, text drawn as paths, without date or document head.

    Args:
        figure: any Matplotlib figure.
        prefix: put before every identifier, so that several figures can stand in one page.
    """
    text = _render(figure, "svg", 72.0).decode()
    text = text[text.index("<svg") :]
    text = re.sub(r"\s*<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    if prefix:
        text = re.sub(r'\bid="', f'id="{prefix}', text)
        text = re.sub(r'(href="#|url\(#)', rf"\g<1>{prefix}", text)
    return text


def save_figure(figure: Figure, path: str | Path, *, dots_per_inch: float = 160.0) -> Path:
    """Write the figure to `path`, in the format its ending names (svg, png, pdf), and return the path.

    A failure leaves nothing half-written.

    Raises:
        UlnaError: an ending that is none of the formats, or a place that cannot be written.

    Examples:
        >>> figure = ulna.plot_poles([-1 + 2j, -1 - 2j])
        >>> ulna.save_figure(figure, "poles.svg").name
        'poles.svg'
    """
    target = Path(path)
    suffix = target.suffix.lower().lstrip(".")
    if suffix not in FORMATS:
        raise UlnaError(
            f"a figure in the file '{target}'",
            f"its ending '{target.suffix}' names no known format.",
            "Use " + ", ".join(f".{name}" for name in FORMATS) + ".",
        )
    data = _render(figure, suffix, dots_per_inch)
    try:
        with whole_file(target) as file:
            file.write(data)
    except OSError as error:
        found = f"it cannot be written: {error.strerror or error}."
        raise UlnaError(f"a figure in the file '{target}'", found) from error
    return target


def _render(figure: Figure, suffix: str, dots_per_inch: float) -> bytes:
    """The figure as a file's bytes, drawn once; `Figure.savefig` draws it twice, the first time for nothing."""
    without_date = {"svg": {"Date": None}, "pdf": {"CreationDate": None}, "png": {}}[suffix]
    buffer = io.BytesIO()
    resolution = figure.dpi
    with mpl.rc_context(_SETTINGS):
        try:
            figure.dpi = dots_per_inch
            canvas = _CANVASES[suffix](figure)
            getattr(canvas, f"print_{suffix}")(buffer, metadata=without_date)
        finally:
            figure.dpi = resolution
    return buffer.getvalue()
