"""The kit that proves that a plugin keeps the promises of `opencsp_calib.interfaces`; for ours and for third parties.

::

    from opencsp_calib.conformance import parametrize_checks

    @parametrize_checks(MySolver())
    def test_conforms(provided, check):
        check(provided)

Every check is physics with a tolerance that has a source: a world whose camera is known, an image whose corners are
known. What only the author knows is given by keyword, as in `Setup`::

    @parametrize_checks(MyFormat(), samples={Path("theirs.xml"): {"cam0": Camera(...)}})
    @parametrize_checks(MyDetector(), boards=(MyBoard(7, 5, 0.03),))
    @parametrize_checks(MySource(), device="/dev/video0")

What is known to fail is said, with its reason; the test then fails when it begins to hold::

    @parametrize_checks(MySolver(), known_failures={"knows_no_unit": "the engine works in millimetres, see issue 12"})
"""

from collections.abc import Mapping
from typing import Any

from opencsp_calib.conformance import (
    abilities,
    board_kinds,
    camera_formats,
    detectors,
    image_sources,
    provided,
    solvers,
)
from opencsp_calib.conformance.kit import Check, Promise, Setup
from opencsp_calib.errors import InputError
from opencsp_calib.interfaces import BoardKind, CameraFormat, Detector, ImageSource, Provided, Solver

__all__ = ["Check", "Setup", "checks_of", "parametrize_checks"]

CONTRACTS: tuple[tuple[Any, tuple[Promise, ...]], ...] = (
    (BoardKind, board_kinds.CHECKS),
    (Detector, detectors.CHECKS),
    (CameraFormat, camera_formats.CHECKS),
    (ImageSource, image_sources.CHECKS),
    (Solver, solvers.CHECKS),
)


def checks_of(thing: Provided, **setup: Any) -> tuple[Check, ...]:
    """The checks of everything that a plugin provides, by its contract.

    Parameters
    ----------
    thing : Provided
    **setup
        As in `Setup`.

    Raises
    ------
    InputError
        If it fulfils none of the contracts of `opencsp_calib.interfaces`.
    """
    known = Setup(**setup)
    checks = [Check(promise.__name__, promise, known, runs=False) for promise in provided.CHECKS]
    kept = [promises for contract, promises in CONTRACTS if isinstance(thing, contract)]
    if not kept:
        names = ", ".join(contract.__name__ for contract, _ in CONTRACTS)
        raise InputError(f"{thing!r} has not all that one of these contracts asks for: {names}")
    checks += [Check(promise.__name__, promise, known) for promises in kept for promise in promises]
    if isinstance(thing, Solver):
        named = {"says_what_it_can_do": solvers.says_what_it_can_do, **solvers.model_checks(thing)}
        asked = [abilities.CHECKS[ability] for ability in sorted(thing.abilities) if ability in abilities.CHECKS]
        checks += [Check(name, promise, known) for name, promise in named.items()]
        checks += [Check(promise.__name__, promise, known) for promise in asked]
    return tuple(checks)


def parametrize_checks(*things: Provided, known_failures: Mapping[str, str] | None = None, **setup: Any) -> Any:
    """A pytest decorator: a test function with the arguments `provided` and `check` for each thing and each check.

    What is missing something (`Provided.missing`) is skipped, with what it says.

    Parameters
    ----------
    *things : Provided
    known_failures : mapping of str to str
        Names of checks that fail, with the reason: strict, so that the reason goes when the failure does.
    **setup
        As in `Setup`.

    Raises
    ------
    InputError
        If a known failure names no check.
    """
    import pytest

    failures = dict(known_failures or {})
    pairs = [(thing, check) for thing in things for check in checks_of(thing, **setup)]
    unknown = sorted(set(failures) - {check.name for _, check in pairs})
    if unknown:
        raise InputError(f"no check is called {', '.join(unknown)}; there are {', '.join(c.name for _, c in pairs)}")

    def marks(thing: Provided, check: Check) -> list[Any]:
        missing = thing.missing() if check.runs else None
        if missing:
            return [pytest.mark.skip(reason=missing)]
        if check.name in failures:
            return [pytest.mark.xfail(reason=failures[check.name], strict=True)]
        return []

    parameters = [
        pytest.param(thing, check, id=f"{thing.name}-{check.name}", marks=marks(thing, check)) for thing, check in pairs
    ]
    return pytest.mark.parametrize(("provided", "check"), parameters)
