"""How far to trust the result: honest sigmas against those of the residuals, over the image, over range, by view."""

from typing import TYPE_CHECKING

import numpy as np

from opencsp_calib.calibration import Calibration
from opencsp_calib.errors import CalibError
from opencsp_calib.projection_sigma import board_ranges, sigma_map, sigma_over_range
from opencsp_calib.report.figures import ACCENT, COLOURS, as_image, colour_bar, image_axes, new_figure
from opencsp_calib.report.html import table
from opencsp_calib.resampling import nearby_halves
from opencsp_calib.uncertainty import Influence, influence, student_factor

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["influence_plot", "range_plot", "sigma_plot", "trust_section"]


def trust_section(calibration: Calibration) -> str:
    """The whole section; without a known uncertainty, a sentence that says so."""
    if not np.isfinite(calibration.covariance).all():
        return "<h2>How far to trust it</h2><p>The uncertainty of this result is not known: see the warnings.</p>"
    influences = influence(calibration)
    factor = student_factor(len(influences))
    names = calibration.camera.lens.parameter_names
    by_residuals = np.sqrt(np.diag(calibration.covariance_residual))
    rows = [
        (name, f"{honest:.3g}", f"{residual:.3g}", f"{honest / residual:.1f}" if residual > 0 else "")
        for name, honest, residual in zip(names, calibration.sigma, by_residuals, strict=True)
    ]
    most = sorted(influences, key=lambda one: -one.share)[:5]
    hanging = [
        (one.image, f"{one.share:.0%}", f"{one.shift_rms_px:.3g}", f"{one.shift_worst_px:.3g}", f"{one.rms_px:.4f}")
        for one in most
    ]
    return (
        "<h2>How far to trust it</h2>"
        "<p>Honest standard deviations come from leaving out each view in turn: neighbouring corners share their "
        "errors and boards flex, so that the residuals alone promise too much. The truth lies within "
        f"{factor:.2f} standard deviations with 95 % confidence. Over the image, frames aligned:</p>"
        + _three_estimates(calibration)
        + as_image(sigma_plot(calibration), "standard deviation of projections over the image")
        + as_image(range_plot(calibration), "standard deviation of projections over range")
        + '<div class="side"><div>'
        + table(("parameter", "honest", "by residuals", "ratio"), rows)
        + "</div><div><p>What single views do when left out, the most influential first:</p>"
        + table(("image", "share", "moves (px rms)", "at worst (px)", "its rms (px)"), hanging)
        + "</div></div>"
        + as_image(influence_plot(influences), "influence of each view")
    )


def _three_estimates(calibration: Calibration) -> str:
    """The same figure three times: one standard deviation of what the camera sees, rms over the image."""
    by_residuals = sigma_map(calibration, covariance=calibration.covariance_residual).rms_px
    rows = [
        ("residuals, as if corners erred independently", f"{by_residuals:.3g}"),
        ("leaving out each view in turn: the honest one", f"{sigma_map(calibration).rms_px:.3g}"),
    ]
    try:
        apart = nearby_halves(calibration)
        rows.append(
            (f"odd against even views: half of the {apart.rms_px:.3g} px between them", f"{apart.rms_px / 2:.3g}")
        )
    except CalibError as error:
        rows.append((f"odd against even views: {error}", ""))
    return table(("estimate, from", "px rms"), rows)


def sigma_plot(calibration: Calibration) -> "Figure":
    """Standard deviation of what the camera sees, in pixels and in milliradians, over the image."""
    figure, panels = new_figure(10, 3.9, 2, gap=1.7)
    found = sigma_map(calibration)
    x, y = found.pixels[..., 0], found.pixels[..., 1]
    for axes, values, unit in zip(panels, (found.sigma_px, found.sigma_rad * 1e3), ("px", "mrad"), strict=True):
        image_axes(axes, calibration.camera.image_size)
        shown = axes.contourf(x, y, values, levels=12, cmap=COLOURS)
        colour_bar(axes, shown, f"one standard deviation ({unit})")
    return figure


def range_plot(calibration: Calibration) -> "Figure":
    """Standard deviation of projections over range; the ranges at which boards were seen are shaded."""
    figure, panels = new_figure(10, 2.6, 2, gap=1.1)
    near, far = board_ranges(calibration)
    curve = sigma_over_range(calibration, np.geomspace(near / 3, far * 10, 60).tolist())
    for axes, values, unit in zip(panels, (curve.sigma_px, curve.sigma_rad * 1e3), ("px", "mrad"), strict=True):
        axes.plot(curve.ranges_m, values, color=ACCENT)
        axes.axvspan(near, far, color=ACCENT, alpha=0.15, label="boards were here")
        axes.set(xscale="log", xlabel="range (m)", ylabel=f"one standard deviation\n({unit}, rms over the image)")
        for write_by in (axes.xaxis.set_major_formatter, axes.xaxis.set_minor_formatter):
            write_by(lambda value, _: f"{value:g}" if f"{value:e}"[0] in "125" else "")  # not powers of ten
        axes.set_ylim(bottom=0)
        axes.legend(frameon=False, fontsize=8)
    return figure


def influence_plot(influences: tuple[Influence, ...]) -> "Figure":
    """How far each view alone moves what the camera sees, in order of capture."""
    figure, (axes,) = new_figure(8, 2.4)
    moves = [one.shift_rms_px for one in influences]
    axes.bar(range(len(moves)), moves, color=ACCENT)
    step = max(1, len(moves) // 25)
    axes.set_xticks(range(0, len(moves), step), [one.image for one in influences][::step], rotation=90, fontsize=7)
    axes.set_ylabel("moves the camera by\n(px rms) if left out", fontsize=8)
    return figure
