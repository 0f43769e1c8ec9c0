"""The board in a report: the shape it really has, where that was solved for."""

from typing import TYPE_CHECKING

import numpy as np

from opencsp_calib.arrays import Floats
from opencsp_calib.board import Board
from opencsp_calib.calibration import Calibration
from opencsp_calib.flatness import FLATNESS_LIMIT_M, Flatness, flatness_of_solved
from opencsp_calib.report.figures import ACCENT, COLOURS, as_image, colour_bar, new_figure
from opencsp_calib.report.html import table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["board_section", "shape_plot"]


def board_section(calibration: Calibration) -> str:
    """Height map and deviations in plane; empty where the board was taken as given."""
    if calibration.options.board_shape == "flat":
        return ""
    shape = flatness_of_solved(calibration)
    height, limit = shape.peak_to_valley_m * 1e3, FLATNESS_LIMIT_M * 1e3
    rows = (
        ("out of flat, peak to valley", f"{height:.3f} mm ({'over' if height > limit else 'within'} {limit:.1f} mm)"),
        ("in plane, largest deviation", f"{np.linalg.norm(shape.in_plane_m, axis=1).max() * 1e3:.3f} mm"),
        ("pitch along y over pitch along x", f"{shape.pitch_ratio:.6f}"),
        ("shear", f"{shape.shear_rad * 1e3:+.3f} mrad"),
    )
    return (
        "<h2>The board as solved</h2>"
        "<p>Against the nominal board, after the similarity that fits best. The calibration knows the board's shape, "
        "not its size: that is as given.</p>"
        + table(("", ""), rows)
        + as_image(shape_plot(calibration.board, shape), "heights and deviations of the board's corners")
    )


def shape_plot(board: Board, shape: Flatness) -> "Figure":
    """Heights of the corners out of the plane, and their deviations within it."""
    figure, (heights, arrows) = new_figure(10, 4.2, 2, gap=1.7)
    nominal = board.nominal_points[shape.ids] * 1e3
    shown = heights.scatter(nominal[:, 0], nominal[:, 1], c=shape.heights_m * 1e3, cmap=COLOURS, s=26, marker="s")
    colour_bar(heights, shown, "height (mm)")
    in_plane: Floats = shape.in_plane_m * 1e3
    longest = float(np.linalg.norm(in_plane, axis=1).max()) or 1.0
    scale = longest / (board.spacing_m * 1e3)  # the longest arrow is one square long
    arrows.quiver(*nominal[:, :2].T, *in_plane.T, angles="xy", scale_units="xy", scale=scale, color=ACCENT)
    for axes, title in ((heights, "out of the plane"), (arrows, f"in the plane, up to {longest:.3f} mm")):
        axes.set(aspect="equal", title=title, xlabel="board x (mm)", ylabel="board y (mm)")
        axes.invert_yaxis()
    return figure
