"""Making figures with matplotlib, without its global state, and putting them into a page."""

import base64
import io
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from opencsp_calib.atomic import replacing
from opencsp_calib.errors import InputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["ACCENT", "COLOURS", "as_image", "colour_bar", "figure_format", "image_axes", "new_figure", "save_figure"]

ACCENT = "#0b6e99"
COLOURS = "viridis"
MARGINS = (0.6, 0.2, 0.45, 0.3)  # inches left, right, below, above for labels: an engine that fits them takes most time
GAP = 0.7  # inches, enough for the labels of the next axes
PADDING = 0.1  # inches
STYLE: dict[str, Any] = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 10,
    "svg.fonttype": "path",  # looks the same whatever fonts the reader has
}


def new_figure(width: float, height: float, columns: int = 1, *, gap: float = GAP) -> "tuple[Figure, list[Axes]]":
    """A figure of so many inches, with axes side by side and a gap of so many inches between them."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    left, right, bottom, top = MARGINS
    each = (width - left - right - (columns - 1) * gap) / columns
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(width, height))
        grid = figure.add_gridspec(
            1, columns, left=left / width, right=1 - right / width, bottom=bottom / height, top=1 - top / height,
            wspace=gap / each,
        )  # fmt: skip
        return figure, [figure.add_subplot(grid[index]) for index in range(columns)]


def image_axes(axes: "Axes", image_size: tuple[int, int], title: str = "") -> None:
    """Axes that are the image: y down, pixels square, from pixel edge to pixel edge."""
    width, height = image_size
    axes.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5), aspect="equal", title=title)
    axes.set_xlabel("x (px)")
    axes.set_ylabel("y (px)")


def colour_bar(axes: "Axes", shown: Any, label: str = "") -> None:
    """What the colours of something shown in axes mean, to their right."""
    import matplotlib as mpl

    with mpl.rc_context(STYLE):
        axes.figure.colorbar(shown, cax=axes.inset_axes((1.03, 0.1, 0.04, 0.8)), label=label)


def as_image(figure: "Figure", alternative: str) -> str:
    """The figure as an ``img`` element, drawn as vectors."""
    import html

    import matplotlib as mpl

    buffer = io.BytesIO()
    with mpl.rc_context(STYLE):
        seen = figure.get_tightbbox().padded(PADDING)  # bbox_inches="tight" would draw it once more to learn that
        figure.savefig(buffer, format="svg", dpi=130, bbox_inches=seen, metadata={"Date": None})
    data = base64.b64encode(buffer.getvalue()).decode()
    return f'<img class="plot" alt="{html.escape(alternative)}" src="data:image/svg+xml;base64,{data}">'


def figure_format(path: str | PathLike[str]) -> str:
    """What a figure is saved as, by the file's extension: ``png``, ``svg`` or ``pdf``.

    Raises
    ------
    InputError
        If it is another extension.
    """
    form = Path(path).suffix.lower().removeprefix(".")
    if form not in ("png", "svg", "pdf"):
        raise InputError(f"a plot is saved as .png, .svg or .pdf, not as {Path(path).name}")
    return form


def save_figure(figure: "Figure", path: str | PathLike[str]) -> None:
    """Write a figure as PNG, SVG or PDF, by the extension.

    Raises
    ------
    InputError
        If it is another extension, or cannot be written.
    """
    form = figure_format(path)
    with replacing(path) as temporary:
        figure.savefig(temporary, format=form, dpi=150, bbox_inches="tight")
