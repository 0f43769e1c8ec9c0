"""The page of a validation: verdict and reasons first, then every comparison with its map."""

import os
from html import escape

from opencsp_calib.comparison import compare
from opencsp_calib.report.document import write_document
from opencsp_calib.report.figures import as_image
from opencsp_calib.report.html import table
from opencsp_calib.report.plots import difference_plot
from opencsp_calib.validate import SENTENCES, Validation

__all__ = ["validation_sections", "write_validation"]


def write_validation(validation: Validation, path: str | os.PathLike[str]) -> None:
    """Write the report of a validation, one HTML file, aside and then in place.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    name = validation.calibration.camera.name
    write_document(f"Validation of {name}", validation_sections(validation), path)


def validation_sections(validation: Validation) -> tuple[str, ...]:
    """The sections of the page, HTML."""
    name = validation.calibration.camera.name
    return _verdict(validation, name), _solvers(validation), _halves(validation), _models(validation)


def _verdict(validation: Validation, name: str) -> str:
    level = "good" if validation.verdict == "agree" else "bad"
    sentence = SENTENCES[validation.verdict]
    reasons = "".join(f"<li>{escape(reason)}</li>" for reason in validation.reasons)
    return f'<h1>Validation of {escape(name)}</h1><div class="verdict {level}">{sentence}</div><ul>{reasons}</ul>'


def _solvers(validation: Validation) -> str:
    rows = [
        (one.name, one.version, f"{one.calibration.rms_px:.6f}", f"{one.seconds:.2f}") for one in validation.solvers
    ]
    maps = "".join(
        f"<div><h3>{escape(pair.a)} and {escape(pair.b)}: {'agree' if pair.agree else 'do not agree'}</h3>"
        + as_image(difference_plot(pair.difference), f"difference of {pair.a} and {pair.b}")
        + "</div>"
        for pair in validation.pairs
    )
    return (
        "<h2>Solver against solver</h2><p>The same corners, the board as solved held fixed, equal weights.</p>"
        + table(("solver", "version", "rms (px)", "seconds"), rows)
        + f'<div class="side">{maps}</div>'
    )


def _halves(validation: Validation) -> str:
    own = validation.trials.own
    if own is None:
        return ""
    plot = as_image(difference_plot(own.halves.difference), "difference of the halves")
    return (
        "<h2>Half against half</h2><p>The odd and the even views, solved apart, compared by what their cameras see; "
        f"the honest uncertainty predicts a median of {validation.predicted_px:.3g} px.</p>{plot}"
    )


def _models(validation: Validation) -> str:
    other = validation.trials.other_board
    trials = (*validation.trials.models, *([other] if other else []))
    rows = [
        (
            trial.model,
            trial.board_shape,
            f"{trial.calibration.rms_px:.4f}",
            f"{trial.held_out.rms_px:.4f}",
            f"{trial.halves.difference.rms_px:.3g}",
        )
        for trial in trials
    ]
    remarks = [
        f"{trial.model}, {trial.board_shape} board: "
        + "; ".join((*(["the one that the data support"] if trial.supported else []), *trial.signs))
        for trial in trials
        if trial.supported or trial.signs
    ]
    return (
        "<h2>Models, and the board</h2><p>A richer model always lowers the rms; what counts is whether views that were "
        "held out, and halves, agree better.</p>"
        + table(("lens model", "board", "rms (px)", "held out (px)", "halves (px rms)"), rows)
        + f"<ul>{''.join(f'<li>{escape(remark)}</li>' for remark in remarks)}</ul>"
        + _board(validation)
    )


def _board(validation: Validation) -> str:
    own, other = validation.trials.own, validation.trials.other_board
    if own is None or other is None:
        return ""
    title = f"{own.board_shape} board and {other.board_shape} board"
    plot = difference_plot(compare(own.calibration.camera, other.calibration.camera))
    return f"<h3>{title}: what solving for its shape does to the camera</h3>{as_image(plot, title)}"
