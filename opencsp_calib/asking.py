"""Which solver is asked for what: the defaults filled in, and what it is not able to do refused before any work."""

from typing import Any, Literal

from opencsp_calib.camera import Camera
from opencsp_calib.errors import InputError
from opencsp_calib.interfaces import Solver
from opencsp_calib.models import lens_model
from opencsp_calib.options import BoardShape, PixelAspect, SolveOptions, Weights
from opencsp_calib.registry import installed

__all__ = ["DEFAULT_MODEL", "DEFAULT_SOLVER", "asked", "check_solving"]

DEFAULT_MODEL = "opencv4"
DEFAULT_SOLVER = "bundle"
OF_SOLVER = ("board_shape", "pixel_aspect", "weights", "robust", "guess")


def check_solving(model: str = DEFAULT_MODEL, solver: str = DEFAULT_SOLVER, **options: Any) -> None:
    """Refuse what no solution can come of, before any image is looked at; `options` as for `pipeline.solve`.

    Raises
    ------
    InputError
        If there is no such lens model or solver, or the solver is not able to do what is asked.
    """
    asked(model, solver, **{key: options[key] for key in OF_SOLVER if key in options})


def asked(
    model: str,
    solver: str,
    board_shape: BoardShape | Literal["auto"] = "auto",
    pixel_aspect: PixelAspect | None = None,
    weights: Weights | None = None,
    robust: bool | None = None,
    guess: Camera | None = None,
) -> tuple[Solver, SolveOptions]:
    """The solver of that name, and what it is asked for; parameters and errors as for `pipeline.solve`."""
    engine = installed().solver(solver)
    careful = solver == DEFAULT_SOLVER
    options = SolveOptions(
        guess=guess,
        board_shape="flat" if board_shape == "auto" else board_shape,
        pixel_aspect=_held_aspect(pixel_aspect),
        weights=weights or ("covariance" if careful else "equal"),
        robust=careful if robust is None else robust,
    )
    _check_abilities(engine, model, options)
    return engine, options


def _held_aspect(pixel_aspect: PixelAspect | None) -> float | None:
    if pixel_aspect is None or pixel_aspect == "free":
        return None
    return 1.0 if pixel_aspect == "square" else float(pixel_aspect)


def _check_abilities(engine: Solver, model: str, options: SolveOptions) -> None:
    """Refuse what a solver is not able to do, naming those that are."""
    lens_model(model)  # an unknown one is refused first
    lacking = ", ".join(sorted(options.asked - engine.abilities))
    if model in engine.models and not lacking:
        return
    what = f"is not able to do what is asked ({lacking})" if lacking else f"has no lens model {model!r}"
    solvers = sorted(installed().solvers.values(), key=lambda solver: solver.name)
    able = [s.name for s in solvers if model in s.models and options.asked <= s.abilities and s.missing() is None]
    raise InputError(f"the solver {engine.name!r} {what}; solvers that are able: {', '.join(able) or 'none installed'}")
