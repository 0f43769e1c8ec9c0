"""The plots of a calibration and of a comparison, each a function of frozen values that gives a figure."""

from os import PathLike
from typing import TYPE_CHECKING

import numpy as np

from opencsp_calib.arrays import Floats, Params, Pixels
from opencsp_calib.calibration import Calibration
from opencsp_calib.camera import Camera
from opencsp_calib.comparison import Difference
from opencsp_calib.quality import correlations, worst_views
from opencsp_calib.report.figures import ACCENT, COLOURS, colour_bar, image_axes, new_figure, save_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = [
    "correlation_plot",
    "coverage_plot",
    "difference_plot",
    "distortion_plot",
    "distortion_size_plot",
    "plot_difference",
    "pose_plot",
    "residual_histogram",
    "residual_plot",
    "rms_plot",
]

ARROWS_ACROSS = 12  # along the short side, as the seed draws them
MOST_ARROWS = 20_000  # of residuals: of more none could be told from the others, and matplotlib takes 1 kB for each
RADIAL = ("k1", "k2", "k3", "k4", "k5", "k6")


def rms_plot(calibration: Calibration) -> "Figure":
    """Rms of each used view, in order of capture; the five worst stand out."""
    figure, (axes,) = new_figure(8, 2.6)
    rms = calibration.view_rms_px
    colours = np.where(np.isin(np.arange(len(rms)), worst_views(calibration)), "#c8553d", ACCENT)
    axes.bar(np.arange(len(rms)), rms, color=colours)
    axes.axhline(calibration.rms_px, color="black", linewidth=0.8, linestyle="--", label="all views")
    names = [view.image for view in calibration.observations.used]
    step = max(1, len(names) // 25)
    axes.set_xticks(np.arange(0, len(names), step), names[::step], rotation=90, fontsize=7)
    axes.set_ylabel("rms (px)")
    axes.legend(frameon=False, fontsize=8)
    return figure


def residual_plot(calibration: Calibration) -> "Figure":
    """Residuals over the image, of at most `MOST_ARROWS` corners; enlarged so that their rms is 1 % of its width."""
    figure, (axes,) = new_figure(8, 6)
    pixels, residuals = _pixels_and_residuals(calibration)
    corners = len(pixels)
    if corners > MOST_ARROWS:  # drawn at random, but always the same ones
        some = np.sort(np.random.default_rng(corners).permutation(corners)[:MOST_ARROWS])
        pixels, residuals = pixels[some], residuals[some]
    size = calibration.camera.image_size
    image_axes(axes, size)
    scale = 0.01 * size[0] / calibration.rms_px if calibration.rms_px > 0 else 1.0
    lengths = np.linalg.norm(residuals, axis=1)
    arrows = axes.quiver(
        *pixels.T,
        *residuals.T,
        lengths,
        angles="xy",
        scale_units="xy",
        scale=1 / scale,
        width=0.0012,
        cmap=COLOURS,
        rasterized=True,
    )
    colour_bar(axes, arrows, "residual (px)")
    drawn = f"; {len(pixels)} of {corners} corners" if len(pixels) < corners else ""
    axes.set_title(f"predicted minus detected, {scale:.0f} times enlarged{drawn}")
    return figure


def residual_histogram(calibration: Calibration) -> "Figure":
    """How the residuals are spread, in x and in y, with the normal distribution of the same width."""
    figure, panels = new_figure(8, 2.6, 2)
    _, residuals = _pixels_and_residuals(calibration)
    for axes, values, name in zip(panels, residuals.T, "xy", strict=True):
        sigma = float(values.std()) or 1.0
        edges = np.linspace(-4, 4, 61) * sigma
        axes.hist(values, edges.tolist(), color=ACCENT)
        expected = (
            len(values) * (edges[1] - edges[0]) / (sigma * np.sqrt(2 * np.pi)) * np.exp(-0.5 * (edges / sigma) ** 2)
        )
        axes.plot(edges, expected, color="black", linewidth=0.8)
        axes.locator_params(axis="x", nbins=6)  # more run into each other
        axes.set_xlabel(f"residual in {name} (px), standard deviation {sigma:.4f}")
    return figure


def coverage_plot(calibration: Calibration) -> "Figure":
    """Where in the image corners were seen."""
    figure, (axes,) = new_figure(6, 4.5)
    size = calibration.camera.image_size
    image_axes(axes, size)
    pixels, _ = _pixels_and_residuals(calibration)
    across, down = 24, max(1, round(24 * size[1] / size[0]))
    x, y = np.linspace(-0.5, size[0] - 0.5, across + 1), np.linspace(-0.5, size[1] - 0.5, down + 1)
    counts, _, _ = np.histogram2d(pixels[:, 0], pixels[:, 1], bins=[x, y])
    shown = axes.pcolormesh(x, y, np.where(counts > 0, counts, np.nan).T, cmap=COLOURS)
    colour_bar(axes, shown, "corners")
    axes.set_facecolor("#eeeeee")
    return figure


def distortion_plot(camera: Camera) -> "Figure":
    """Radial, tangential and total distortion as arrows over the image, each enlarged to be seen."""
    figure, panels = new_figure(11, 3.4, 3)
    names = camera.lens.distortion_names
    radial = np.array([name in RADIAL for name in names], dtype=bool)
    parts = (
        ("radial", np.where(radial, camera.distortion, 0.0)),
        ("tangential", np.where(radial, 0.0, camera.distortion)),
        ("total", camera.distortion),
    )
    step = min(camera.image_size) / ARROWS_ACROSS
    x, y = np.meshgrid(*(np.arange(step / 2, side, step) for side in camera.image_size))
    ideal = np.column_stack([x.ravel(), y.ravel()])
    for axes, (title, distortion) in zip(panels, parts, strict=True):
        shift = _distortion(camera, distortion, ideal)
        longest = np.nanmax(np.linalg.norm(shift, axis=1)) if np.isfinite(shift).any() else 0.0
        enlarged = step / longest if longest > 0 else 1.0
        image_axes(axes, camera.image_size, f"{title}: up to {longest:.3g} px")
        axes.quiver(*ideal.T, *(shift.T * enlarged), angles="xy", scale_units="xy", scale=1, color=ACCENT, width=0.003)
    return figure


def distortion_size_plot(camera: Camera) -> "Figure":
    """How many pixels the distortion moves each point of the image."""
    figure, (axes,) = new_figure(6, 4.5)
    image_axes(axes, camera.image_size)
    x, y = np.meshgrid(*(np.linspace(0, side - 1, 81) for side in camera.image_size))
    shift = _distortion(camera, camera.distortion, np.column_stack([x.ravel(), y.ravel()]))
    sizes = np.linalg.norm(shift, axis=1).reshape(x.shape)
    if np.nanmax(sizes) > 0:
        lines = axes.contour(x, y, sizes, levels=10, cmap=COLOURS)
        axes.clabel(lines, fmt="%.3g", fontsize=8)
    axes.plot(*camera.params[2:4], "+", color="black", markersize=10)
    axes.set_title("distortion (px); the cross is the principal point")
    return figure


def pose_plot(calibration: Calibration) -> "Figure":
    """The boards before the camera, as the camera sees them: x right, y down, z forward."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 8))
    axes = figure.add_subplot(projection="3d")
    columns, rows = calibration.board.grid
    corner_ids = [0, columns - 1, columns * rows - 1, columns * (rows - 1), 0]
    outline = calibration.board.points[corner_ids]
    outlines = np.array([pose.transform(outline) for pose in calibration.cam_from_board])
    seen = np.concatenate([np.zeros((1, 3)), outlines.reshape(-1, 3)])
    gaps = np.full((len(outlines), 1, 3), np.nan)  # one line with gaps: an artist for each board takes long
    x, y, z = np.concatenate([outlines, gaps], axis=1).reshape(-1, 3).T
    axes.plot(x, z, -y, color=ACCENT, linewidth=0.8)
    x, y, z = outlines[:, 0].T
    axes.scatter(x, z, -y, color="#c8553d", s=6, depthshade=False)
    axes.scatter([0], [0], [0], color="black", marker="^", s=40)
    low, high = seen.min(axis=0), seen.max(axis=0)
    axes.set_box_aspect((max(high[0] - low[0], 1e-6), max(high[2] - low[2], 1e-6), max(high[1] - low[1], 1e-6)))
    axes.set(xlabel="x (m)", ylabel="z (m)", zlabel="-y (m)")
    return figure


def correlation_plot(calibration: Calibration) -> "Figure":
    """Which parameters can hardly be told apart: their correlations."""
    figure, (axes,) = new_figure(5, 4.4)
    axes.set_title("correlations")
    names = calibration.camera.lens.parameter_names
    values = correlations(calibration)
    shown = axes.imshow(values, cmap="RdBu_r", vmin=-1, vmax=1)
    axes.set_xticks(range(len(names)), names, rotation=90)
    axes.set_yticks(range(len(names)), names)
    if len(names) <= 9:
        for (row, column), value in np.ndenumerate(values):
            colour = "white" if abs(value) > 0.6 else "black"
            axes.text(column, row, f"{value:.2f}", ha="center", va="center", fontsize=7, color=colour)
    colour_bar(axes, shown)
    return figure


def difference_plot(difference: Difference) -> "Figure":
    """How far apart two cameras see, over the image, once their frames are aligned."""
    figure, (axes,) = new_figure(6.5, 4.8)
    x, y = difference.pixels[..., 0], difference.pixels[..., 1]
    lengths = difference.length_px
    image_axes(axes, (round(x.max()) + 1, round(y.max()) + 1))
    if np.nanmax(lengths) > np.nanmin(lengths):
        shown = axes.contourf(x, y, lengths, levels=12, cmap=COLOURS)
        colour_bar(axes, shown, "difference (px)")
    step = max(1, x.shape[1] // 12)
    few = (slice(None, None, step), slice(None, None, step))
    axes.quiver(
        x[few], y[few], difference.shift[few][..., 0], difference.shift[few][..., 1], angles="xy", color="white"
    )
    axes.set_title(f"{difference.where}: rms {difference.rms_px:.3g} px, worst {difference.worst_px:.3g} px")
    return figure


def plot_difference(difference: Difference, path: str | PathLike[str]) -> None:
    """Write the picture of a comparison as PNG, SVG or PDF; raises InputError."""
    save_figure(difference_plot(difference), path)


def _pixels_and_residuals(calibration: Calibration) -> tuple[Pixels, Floats]:
    kept = [~outliers for outliers in calibration.outliers]
    detections = calibration.observations.detections
    pixels = np.concatenate([detection.pixels[k] for detection, k in zip(detections, kept, strict=True)])
    return pixels, np.concatenate([r[k] for r, k in zip(calibration.residuals, kept, strict=True)])


def _distortion(camera: Camera, distortion: Params, ideal: Pixels) -> Floats:
    """(N, 2) px: where a lens with this distortion images what a pinhole images at the ideal pixels, minus those."""
    rays = np.column_stack([(ideal - camera.params[2:4]) / camera.params[:2], np.ones(len(ideal))])
    return camera.lens.project(rays, np.concatenate([camera.params[:4], distortion])) - ideal
