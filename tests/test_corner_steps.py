"""The steps of a corner's fit: each is Gauss-Newton's, none goes too far, the first that is short enough ends it."""

import numpy as np
import pytest
from corner_model import BENDS, CENTRED, DIM, UPRIGHT, normal_equations, photograph_of, seen

from opencsp_calib.arrays import Floats
from opencsp_calib.corner_kernel import PARAMETERS, fit_corners

HALF = np.array([9.3, 8.1, np.inf, np.inf])
CONVERGED, OUTSIDE, FAILED = 0, 1, 2


def moved(p: Floats, **by: float) -> Floats:
    names = ("x", "y", "angle_1", "angle_2", "blur", "a", "b", "a_by_x", "a_by_y", "b_by_x", "b_by_y")
    return p + [by.get(name, 0.0) for name in names]


def after(
    photograph: Floats, start: Floats, steps: int = 1, tolerance: float = 1e-5, half: Floats = HALF
) -> tuple[Floats, int]:
    """The parameters after so many steps, and the status."""
    p = start[None].copy()
    found = fit_corners(photograph, 255, p, BENDS[None], half[None], tolerance, steps, examine=False)
    return p[0], int(found[0, 0])


def newton(photograph: Floats, p: Floats, half: Floats = HALF) -> Floats:
    """The whole step from there."""
    _, _, derivatives, residual = seen(photograph, p, half)
    return np.linalg.solve(*normal_equations(p, derivatives, residual))


def grey(p: Floats) -> Floats:
    return np.rint(photograph_of(p)).astype(np.uint8)


@pytest.mark.parametrize("half", [HALF, [3.2, 11.7, np.inf, np.inf], [9.3, 9.3, 5.4, 3.2]])
def test_a_short_step_is_gauss_newtons(half: Floats) -> None:
    photograph, start = grey(DIM), moved(DIM, x=0.25, y=-0.125, angle_1=0.03, angle_2=-0.02, blur=0.1, a=0.5, b=-0.3)
    step = newton(photograph, start, np.asarray(half))
    p, status = after(photograph, start, half=np.asarray(half))
    assert status == FAILED  # it has not ended yet
    assert p - start == pytest.approx(step, rel=1e-3, abs=1e-5)


@pytest.mark.parametrize(
    ("off", "limit"),
    [
        ({"x": 3.0}, lambda p, step: 1.5 / np.hypot(*step[:2])),
        ({"x": 1.5, "y": 2.0}, lambda p, step: 1.5 / np.hypot(*step[:2])),
        ({"angle_1": 0.5}, lambda p, step: 0.3 / abs(step[2])),
        ({"angle_2": -0.5}, lambda p, step: 0.3 / abs(step[3])),
        ({"blur": -2.0}, lambda p, step: 0.6 * p[4] / abs(step[4])),
    ],
)
def test_a_long_step_is_cut_to_where_the_model_is_nearly_linear(off: dict[str, float], limit) -> None:
    soft = moved(CENTRED, blur=1.7)
    photograph, start = grey(soft), moved(soft, **off)
    step = newton(photograph, start)
    fraction = limit(start, step)
    assert fraction < 1
    p, _ = after(photograph, start)
    assert p - start == pytest.approx(fraction * step, rel=1e-3, abs=1e-5)


def test_no_corner_gets_sharper_than_a_pixel_can_see() -> None:
    """And the other parameters go where they would if the blur were known."""
    photograph, start = grey(moved(CENTRED, blur=-1.05)), moved(CENTRED, x=0.125)
    start[4] = 0.3
    _, _, derivatives, residual = seen(photograph, start, HALF)
    normal, gradient = normal_equations(start, derivatives, residual)
    assert gradient[4] < 0
    others = np.arange(PARAMETERS) != 4
    step = np.linalg.solve(normal[np.ix_(others, others)], gradient[others])
    p, _ = after(photograph, start)
    assert p[4] == 0.3
    assert (p - start)[others] == pytest.approx(step, rel=1e-3, abs=1e-4)


@pytest.mark.parametrize(
    ("off", "steps"),
    [
        ({"x": -4.9, "y": 3.6, "angle_1": 0.5, "blur": 1.9}, 1),
        ({"x": 4.5, "y": -4.7, "angle_1": -0.5, "blur": -0.7}, 2),
    ],
)
def test_a_step_that_makes_it_worse_is_halved(off: dict[str, float], steps: int) -> None:
    photograph, start = grey(CENTRED), moved(CENTRED, **off)
    (before, _), (once, _), (twice, _) = (after(photograph, start, n) for n in (steps - 1, steps, steps + 1))
    assert 1.2 < misfit(photograph, once) / misfit(photograph, before) < 1.4
    assert twice - before == pytest.approx((once - before) / 2, rel=1e-4, abs=1e-5)


@pytest.mark.parametrize(
    ("spot", "off", "swing"),
    [
        ((42, 40, 2, 255), {"x": -0.25}, 0.44),  # along the rows
        ((43, 39, 3, 200), {}, 0.52),
        ((39, 44, 3, 255), {}, 0.43),  # along the columns
        ((38, 41, 3, 255), {"y": 0.25}, 0.58),
        ((40, 39, 2, 255), {"x": -0.25, "y": -0.75}, 0.47),
        ((40, 39, 2, 255), {"x": 0.5, "y": 0.25}, 0.58),
    ],
)
def test_a_step_that_goes_back_over_half_of_the_last_is_halved(
    spot: tuple[int, int, int, int], off: dict[str, float], swing: float
) -> None:
    """In a small window with a stain, which the window follows."""
    sharp, half = moved(CENTRED, blur=-0.8), np.array([4.3, 4.1, np.inf, np.inf])
    row, column, side, level = spot
    photograph = grey(sharp)
    photograph[row : row + side, column : column + side] = level
    start = moved(sharp, **off)
    (once, _), (twice, _) = (after(photograph, start, steps, half=half) for steps in (1, 2))
    last, step = once - start, newton(photograph, once, half)
    assert -(last[:2] @ step[:2]) / (last[:2] @ last[:2]) == pytest.approx(swing, abs=0.01)
    assert twice - once == pytest.approx(step * (0.5 if swing > 0.5 else 1.0), rel=1e-3, abs=1e-4)


def misfit(photograph: Floats, p: Floats) -> float:
    _, _, derivatives, residual = seen(photograph, p, HALF)
    return float(residual @ residual / (derivatives[5] ** 2).sum())


@pytest.mark.parametrize(
    ("off", "measure", "allowed"),
    [
        ({"x": 0.25, "y": 0.5}, lambda step: np.hypot(*step[:2]), 1),
        ({"blur": 0.05}, lambda step: abs(step[4]), 10),
    ],
)
def test_it_ends_with_the_first_step_that_is_within_the_tolerance(off: dict[str, float], measure, allowed) -> None:
    photograph, start = grey(CENTRED), moved(CENTRED, **off)
    step = newton(photograph, start)
    tolerance = measure(step) / allowed
    (p, status), (_, too_long) = (after(photograph, start, tolerance=part * tolerance) for part in (1.01, 0.99))
    assert (status, too_long) == (CONVERGED, FAILED)
    assert p - start == pytest.approx(step, rel=1e-3, abs=1e-4)  # which is still taken


@pytest.mark.parametrize("name", ["a", "b"])
def test_grey_levels_that_still_change_have_not_been_judged(name: str) -> None:
    photograph = grey(CENTRED)
    ends = {}
    for share in (0.04, 0.06):
        start = moved(CENTRED, **{name: share * CENTRED[6]})
        step = newton(photograph, start)
        assert (abs(step[5]) + abs(step[6]) < 0.05 * start[6]) == (share < 0.05)
        ends[share] = after(photograph, start, tolerance=1.0)[1]
    assert ends == {0.04: CONVERGED, 0.06: FAILED}


@pytest.mark.parametrize(
    ("at", "columns", "rows", "enough"),
    [(0.0, 3, 11, True), (0.5, 4, 8, False), (0.5, 32, 34, True), (0.0, 33, 33, False)],
)
def test_a_window_has_three_pixels_for_each_parameter_and_no_more_than_there_is_room_for(
    at: float, columns: int, rows: int, enough: bool
) -> None:
    """33 and 1088."""
    start = moved(UPRIGHT, x=at, y=at)
    half = np.array([columns / 2 - 0.85, rows / 2 - 0.85, np.inf, np.inf])  # the ramp adds 0.75 px
    _, status = after(grey(start), start, half=half)
    assert (status != OUTSIDE) == enough


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("end", ["near", "far"])
def test_a_window_may_reach_the_border_of_the_image_and_no_farther(axis: int, end: str) -> None:
    photograph = grey(UPRIGHT)[:70]
    half, sides = np.array([6.25, 8.25, np.inf, np.inf]), (80, 70)
    for beyond in (-1e-3, 1e-3):
        start = UPRIGHT.copy()
        reach = half[axis] + 0.75 - beyond
        start[axis] = reach if end == "near" else sides[axis] - 1 - reach
        assert (after(photograph, start, half=half)[1] == OUTSIDE) == (beyond > 0)


def test_what_has_no_second_edge_cannot_be_fitted() -> None:
    flat = np.full((80, 80), 100, np.uint8)
    assert after(flat, UPRIGHT, steps=20)[1] == FAILED


def test_a_corner_without_contrast_has_no_step() -> None:
    """Also where the one before it had: nothing is known of where it is."""
    starts = np.array([moved(CENTRED, x=0.25), moved(CENTRED, b=-CENTRED[6], b_by_x=-1.0, b_by_y=0.8)])
    p, bends, windows = starts.copy(), np.tile(BENDS, (2, 1)), np.tile(HALF, (2, 1))
    found = fit_corners(grey(CENTRED), 255, p, bends, windows, 1e-5, 20, examine=False)
    assert found[:, 0].tolist() == [CONVERGED, FAILED]
    assert p[1] == pytest.approx(starts[1], abs=1e-5)


@pytest.mark.parametrize(("examine", "contrast", "told"), [(True, 1.0, True), (False, 1.0, False), (True, 0.0, False)])
def test_more_than_the_status_is_told_where_it_is_wanted_and_known(examine: bool, contrast: float, told: bool) -> None:
    photograph, p = np.rint(100 + contrast * (photograph_of(DIM) - 30)).astype(np.uint8), moved(DIM, a=70.0)[None]
    found = fit_corners(photograph, 255, p, BENDS[None], HALF[None], 1e-5, 20, examine=examine)[0]
    assert (found[0] == CONVERGED) == (contrast > 0)
    assert found[1:].any() == told
