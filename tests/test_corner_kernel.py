"""The compiled fit of a corner, against the same model and the same sums written down in NumPy and double precision."""

from dataclasses import dataclass

import numpy as np
import pytest
from corner_model import BENDS, CENTRED, MODEL, UPRIGHT, columns, image, normal_equations, photograph_of, seen
from scipy.ndimage import map_coordinates

from opencsp_calib.arrays import Floats, Ids
from opencsp_calib.corner_kernel import PARAMETERS, RAMP_PX, fit_corners


@pytest.mark.parametrize("second_edge", [0.15 + np.pi / 2, 1.3, -2.2])
def test_the_model_and_its_derivatives(second_edge: float) -> None:
    x, y = np.random.default_rng(1).uniform(-6, 6, (2, 200))
    p = np.array([*MODEL[:3], second_edge, *MODEL[4:]])
    found = columns(p, x, y)
    assert -found[-1] == pytest.approx(image(p, x, y), abs=2e-3)
    for k in range(PARAMETERS):
        step = np.zeros(PARAMETERS)
        step[k] = 1e-5
        moved = [image(p + way * step, x - way * step[0], y - way * step[1]) for way in (1, -1)]
        numeric = (moved[0] - moved[1]) / 2e-5
        # the smallest terms of the model are left out of its derivatives
        assert np.abs(numeric - found[k]).max() < (0.04 if k < 5 else 1e-4) * np.abs(found[k]).max()


@pytest.mark.parametrize("blur", [0.45, 1.3])
def test_the_model_is_exact_to_single_precision(blur: float) -> None:
    x, y = np.random.default_rng(1).uniform(-6, 6, (2, 200))
    p = np.array([*MODEL[:4], blur, *MODEL[5:]])
    assert -columns(p, x, y)[-1] == pytest.approx(image(p, x, y), abs=1e-4)


def test_how_much_a_pixel_counts() -> None:
    """All within the window, nothing beyond it, and only near an edge where more is printed than the checkerboard."""
    x, y = np.random.default_rng(1).uniform(-8, 8, (2, 1000))
    window = np.array([6.3, 4.8, 3.4, 2.1])
    along = np.abs([y * np.cos(angle) - x * np.sin(angle) for angle in MODEL[[3, 2]]] / np.sin(MODEL[3] - MODEL[2]))
    inside = np.clip((window[:2, None] - along) / RAMP_PX + 0.5, 0, 1).prod(axis=0)
    near = np.clip((window[2:, None] - along).max(axis=0), 0, 1)
    assert columns(MODEL, x, y, window=window)[5] ** 2 == pytest.approx(inside * near, abs=1e-5)


@dataclass(frozen=True)
class Fitted:
    """A corner in a photograph, what was found of it, and its window's pixels: where, derivatives and residual."""

    photograph: Floats
    white: float
    p: Floats
    found: Floats
    row: Ids
    column: Ids
    derivatives: Floats
    residual: Floats


def fit(photograph: Floats, white: float, start: Floats, half: Floats, bends: Floats = BENDS) -> Fitted:
    p, window = start[None].copy(), np.array([*half, np.inf, np.inf])
    found = fit_corners(photograph, white, p, bends[None], window[None], 5e-6, 60, examine=True)
    assert found[0, 0] == 0
    return Fitted(photograph, white, p[0], found[0], *seen(photograph, p[0], window, bends))


@pytest.fixture(scope="module", params=["bright", "dim"])
def fitted(request: pytest.FixtureRequest) -> Fitted:
    """With noise that is alike in no way, and a bright spot in one quarter.

    In the dim one a unit more in a sum is not lost, and the first and the last pixel of the window weigh something.
    """
    start, half, noise, spot, white = (
        (CENTRED, (9.3, 8.1), 3.0, 230, 200.0) if request.param == "bright" else (UPRIGHT, (9.0, 8.0), 0.5, 36, 35.0)
    )
    grey = photograph_of(start) + np.random.default_rng(2).normal(0, noise, (80, 80))
    grey[46:49, 44:50] = spot
    return fit(np.clip(np.rint(grey), 0, 255).astype(np.uint8), white, start, half)


def test_how_sure_a_place_is(fitted: Fitted) -> None:
    normal, gradient = normal_equations(fitted.p, fitted.derivatives, fitted.residual)
    inverse = np.linalg.inv(normal)
    assert fitted.found[3:6] == pytest.approx([inverse[0, 0], inverse[0, 1], inverse[1, 1]], rel=1e-4)
    # and nothing is left to be done
    assert np.abs(inverse @ gradient)[:4].max() < 1e-4


def test_how_a_place_follows_the_bend_of_its_edges() -> None:
    turned = CENTRED + np.eye(PARAMETERS)[2:4].sum(axis=0) * 0.6
    photograph, half = np.rint(200 * photograph_of(turned)).astype(np.uint16), (9.3, 8.1)
    found = fit(photograph, 65535, turned, half).found
    for edge in range(2):
        step = np.eye(2)[edge] * 1e-3
        before, after = (fit(photograph, 65535, turned, half, BENDS + way * step).p for way in (-1, 1))
        assert found[[6 + edge, 8 + edge]] == pytest.approx((after - before)[:2] / 2e-3, abs=0.5)  # of 15


def test_how_it_follows_bends_by_the_derivatives(fitted: Fitted) -> None:
    """A bend moves an edge like a turn by half of it for each pixel from the corner on."""
    normal, _ = normal_equations(fitted.p, fitted.derivatives, fitted.residual)
    x, y = fitted.column - fitted.p[0], fitted.row - fitted.p[1]
    for edge, angle in enumerate(fitted.p[2:4]):
        by_bend = 0.5 * fitted.derivatives[2 + edge] * (x * np.cos(angle) + y * np.sin(angle))
        response = -np.linalg.solve(normal, fitted.derivatives @ by_bend)
        assert fitted.found[[6 + edge, 8 + edge]] == pytest.approx(response[:2], rel=1e-4, abs=1e-4)


def test_what_disturbs_it(fitted: Fitted) -> None:
    p, row, column, residual, found = fitted.p, fitted.row, fitted.column, fitted.residual, fitted.found
    root = fitted.derivatives[5]
    x, y = column - p[0], row - p[1]
    sides = [y * np.cos(angle) > x * np.sin(angle) for angle in p[2:4]]
    quarters = [(sides[0] == one) & (sides[1] == other) for one in (False, True) for other in (False, True)]
    weights = np.array([(root[quarter] ** 2).sum() for quarter in quarters])
    saturated = root**2 * (fitted.photograph[row, column] >= fitted.white)
    assert found[18:22] == pytest.approx(weights, rel=1e-4)
    assert found[14:18] == pytest.approx([saturated[q].sum() for q in quarters] / weights, rel=1e-4)
    misfit = np.array([(root * residual)[quarter].sum() for quarter in quarters]) / weights / abs(p[6])
    assert found[10:14] == pytest.approx(misfit, abs=1e-4)
    assert found[22] == pytest.approx(residual @ residual / (weights.sum() - PARAMETERS), rel=1e-3)
    picture = np.full((80, 80), np.nan)
    picture[row[root > 0.999], column[root > 0.999]] = residual[root > 0.999]
    opposite = map_coordinates(picture, [2 * p[1] - row, 2 * p[0] - column], order=1)
    unlike = (picture[row, column] - opposite)[np.isfinite(picture[row, column] - opposite)]
    right, down = 2 * p[0] % 1, 2 * p[1] % 1
    gain = 1 + (right**2 + (1 - right) ** 2) * (down**2 + (1 - down) ** 2)
    assert found[1] == pytest.approx((unlike**2).sum() / gain / (len(unlike) - 8), rel=1e-3)
    assert found[2] == pytest.approx(np.nanmean(np.diff(picture, axis=1) ** 2) / 2, rel=1e-3)


@pytest.mark.parametrize(("half", "enough"), [((3.9, 3.9), False), ((4.9, 4.9), True)])
def test_few_pixels_with_an_opposite_do_not_tell_how_unlike_they_are(half: Floats, enough: bool) -> None:
    """Then all that the model leaves stands for it."""
    grey = photograph_of(UPRIGHT) + np.random.default_rng(3).normal(0, 0.5, (80, 80))
    found = fit(np.rint(grey).astype(np.uint8), 255, UPRIGHT, half).found
    assert (found[1] != found[22]) == enough


def test_a_corner_is_not_disturbed_by_the_one_before() -> None:
    """Whose window was larger, and brighter."""
    photograph = np.rint(np.hstack([photograph_of(CENTRED), photograph_of(UPRIGHT)])).astype(np.uint8)
    right = UPRIGHT + 80 * np.eye(1, PARAMETERS)[0]
    windows = np.array([[13.0, 13.0, np.inf, np.inf], [5.3, 4.6, np.inf, np.inf]])

    def both(first: int) -> tuple[Floats, Floats]:
        p = np.array([CENTRED, right])[first:]
        bends = np.tile(BENDS, (2, 1))[first:]
        found = fit_corners(photograph, 90, p, bends, windows[first:], 1e-3, 60, examine=True)
        return p[-1], found[-1]

    for alone, after in zip(both(1), both(0), strict=True):
        assert np.array_equal(alone, after)


def test_what_is_left_is_what_the_last_step_leaves() -> None:
    photograph = np.rint(photograph_of(CENTRED)).astype(np.uint8)
    window, start = np.array([9.3, 8.1, np.inf, np.inf]), CENTRED + 0.25 * np.eye(2, PARAMETERS).sum(axis=0)
    _, _, derivatives, residual = seen(photograph, start, window)
    step = np.linalg.solve(*normal_equations(start, derivatives, residual))
    left = residual - step @ derivatives
    found = fit_corners(photograph, 255, start[None].copy(), BENDS[None], window[None], 1.0, 1, examine=True)[0]
    assert found[0] == 0
    assert found[22] == pytest.approx(left @ left / ((derivatives[5] ** 2).sum() - PARAMETERS), rel=1e-3)
