"""The page of a report, section by section: verdict first, provenance last."""

import json
import os
from collections.abc import Iterator
from html import escape

import numpy as np

from opencsp_calib.calibration import Calibration
from opencsp_calib.comparison import compare
from opencsp_calib.judgement import REMARKS, conclusion, judge
from opencsp_calib.quality import set_quality, view_qualities, worst_views
from opencsp_calib.report import plots
from opencsp_calib.report.board_section import board_section
from opencsp_calib.report.document import write_document
from opencsp_calib.report.figures import as_image
from opencsp_calib.report.html import table
from opencsp_calib.report.photographs import photographs
from opencsp_calib.report.trust_section import trust_section
from opencsp_calib.summary import parameter_lines

__all__ = ["changes", "distortion", "parameters", "residuals", "summary", "write_report"]


def write_report(calibration: Calibration, path: str | os.PathLike[str], *, before: Calibration | None = None) -> None:
    """Write the report of a calibration, aside and then in place.

    Parameters
    ----------
    calibration : Calibration
    path : path-like
        Of one HTML file, with everything in it.
    before : Calibration, optional
        As it was before images were dropped.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    write_document(f"Calibration of {calibration.camera.name}", _sections(calibration, before), path)


def _sections(calibration: Calibration, before: Calibration | None) -> Iterator[str]:
    """One after the other, each when it is asked for."""
    yield summary(calibration)
    yield changes(calibration, before)
    yield parameters(calibration)
    yield _views_in_order(calibration)
    yield residuals(calibration)
    yield _coverage_and_poses(calibration)
    yield distortion(calibration)
    yield board_section(calibration)
    yield trust_section(calibration)
    yield '<h2>Photographs</h2><div class="views">'
    yield from photographs(calibration)
    yield "</div>"
    yield _provenance(calibration)


def summary(calibration: Calibration) -> str:
    """The verdict, warnings, and the figures that matter most."""
    camera, whole = calibration.camera, set_quality(calibration)
    problems = judge(calibration)
    judged = conclusion(problems)
    size = " × ".join(map(str, camera.image_size))
    facts = (
        (f"{calibration.rms_px:.4f} px", "rms of all corners"),
        (f"{whole.views} of {len(calibration.observations.views)}", "images used"),
        (f"{sum(map(len, calibration.observations.detections))}", f"corners, {calibration.rejected_corners} rejected"),
        (f"{whole.coverage:.0%}", "of the image covered"),
        (f"{whole.tilts_deg[0]:.0f}–{whole.tilts_deg[2]:.0f}°", f"tilt, median {whole.tilts_deg[1]:.0f}°"),
        (f"{whole.ranges_m[0]:.2f}–{whole.ranges_m[2]:.2f} m", "range"),
        (f"{whole.horizontal} / {whole.vertical}", "boards horizontal / vertical"),
        (calibration.options.board_shape, "board shape"),
    )
    cards = "".join(f"<div><b>{escape(value)}</b>{escape(what)}</div>" for value, what in facts)
    warnings = "".join(
        f"<li{' class=quiet' if p.code in REMARKS else ''}><code>{escape(p.code)}</code> {escape(p.message)}</li>"
        for p in problems
    )
    return (
        f"<h1>{escape(camera.name)}</h1>"
        f'<div class="subtitle">{escape(camera.model)}, {size} px, {escape(calibration.board.spec)}, '
        f"solved by {escape(calibration.solver)}</div>"
        f'<div class="verdict {judged.level}">{escape(judged.sentence)}</div>'
        + (f'<ul class="warnings">{warnings}</ul>' if warnings else "")
        + f'<div class="facts">{cards}</div>'
    )


def changes(calibration: Calibration, before: Calibration | None) -> str:
    """What other images changed, against the result before; empty without one."""
    if before is None:
        return ""
    now, then = ({view.image for view in one.observations.used} for one in (calibration, before))
    sentences = [
        f"{len(names)} {what}: {escape(', '.join(sorted(names)))}."
        for what, names in (("dropped", then - now), ("put back", now - then))
        if names
    ]
    if calibration.camera.image_size == before.camera.image_size:
        shift = compare(before.camera, calibration.camera)
        sentences.append(
            f"What the camera sees moved by {shift.rms_px:.2g} px rms over the image, {shift.worst_px:.2g} px at worst "
            "(frames aligned)."
        )
    rows = [("rms (px)", f"{before.rms_px:.4f}", f"{calibration.rms_px:.4f}")]
    if calibration.camera.model == before.camera.model:
        names = before.camera.lens.parameter_names
        pairs = zip(names, before.camera.params, calibration.camera.params, strict=True)
        rows += [(name, f"{old:.6g}", f"{new:.6g}") for name, old, new in pairs]
    title = "Dropped images" if then - now else "What changed"
    return f"<h2>{title}</h2><p>{' '.join(sentences)}</p>" + table(("", "before", "after"), rows)


def parameters(calibration: Calibration) -> str:
    """Each parameter with its standard deviation, and how they are correlated."""
    lines = parameter_lines(calibration.camera, calibration.sigma, calibration.record)
    notes = "".join(f"<li>{escape(key)}: {escape(value)}</li>" for key, value in calibration.record.items())
    known = bool(np.isfinite(calibration.covariance).all())
    plot = as_image(plots.correlation_plot(calibration), "correlations of the parameters") if known else ""
    return (
        '<h2>Parameters</h2><div class="side"><div>'
        + table(("parameter", "value", "± one standard deviation"), lines)
        + (
            f'<p class="quiet">Kept with the camera; a changed lens setting voids it:</p><ul>{notes}</ul>'
            if notes
            else ""
        )
        + '<p class="quiet">The centre of the upper-left pixel is (0, 0). Correlated parameters (cx with p2, cy with '
        "p1, the focal length with the range) can hardly be told apart one by one; together they are well known.</p>"
        f"</div><div>{plot}</div></div>"
    )


def _views_in_order(calibration: Calibration) -> str:
    qualities = view_qualities(calibration)
    worst = [qualities[index] for index in worst_views(calibration)]
    rows = [(v.image, f"{v.rms_px:.4f}", f"{v.tilt_deg:.1f}", f"{v.range_m:.3f}", v.orientation) for v in worst]
    return (
        "<h2>Each view, in order of capture</h2>"
        + as_image(plots.rms_plot(calibration), "rms of each view")
        + "<p>The five worst:</p>"
        + table(("image", "rms (px)", "tilt (°)", "range (m)", "board"), rows)
    )


def residuals(calibration: Calibration) -> str:
    """Residuals over the image, and how they are spread."""
    return (
        "<h2>Residuals</h2>"
        + as_image(plots.residual_plot(calibration), "residuals over the image")
        + as_image(plots.residual_histogram(calibration), "histogram of the residuals")
    )


def _coverage_and_poses(calibration: Calibration) -> str:
    coverage = as_image(plots.coverage_plot(calibration), "corners seen over the image")
    poses = as_image(plots.pose_plot(calibration), "the boards before the camera")
    return (
        f'<h2>Coverage and poses</h2><div class="side"><div>{coverage}</div><div>{poses}'
        '<p class="quiet">The camera is the black triangle; a red dot marks each board\'s first corner.</p></div></div>'
    )


def distortion(calibration: Calibration) -> str:
    """The distortion as arrows and as a map of its size."""
    return (
        "<h2>Distortion</h2>"
        + as_image(plots.distortion_plot(calibration.camera), "radial, tangential and total distortion")
        + as_image(plots.distortion_size_plot(calibration.camera), "size of the distortion")
    )


def _provenance(calibration: Calibration) -> str:
    options = calibration.options
    aspect = "free" if options.pixel_aspect is None else f"{options.pixel_aspect:g}"
    rows = [
        ("solver", calibration.solver),
        ("board", calibration.observations.board.spec),
        ("board shape", options.board_shape),
        ("pixel aspect", aspect),
        ("weights", options.weights),
        ("robust", "yes" if options.robust else "no"),
        *((key, str(value)) for key, value in calibration.provenance.items() if key != "images"),
    ]
    hashes = {view.image: view.sha256 for view in calibration.observations.views}
    return (
        "<h2>Provenance</h2>"
        + table(("", ""), rows)
        + "<details><summary>Images and their SHA-256</summary>"
        + f"<pre>{escape(json.dumps(hashes, indent=1))}</pre></details>"
    )
