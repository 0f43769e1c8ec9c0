"""The compiled fit of a corner, against the same model and the same sums written down in NumPy and double precision."""

import numpy as np
import pytest
from corner_model import BENDS, CENTRED, MODEL, columns, image, normal_equations, photograph_of, seen
from scipy.ndimage import map_coordinates

from opencsp_calib.arrays import Floats
from opencsp_calib.corner_kernel import PARAMETERS, fit_corners

WHITE = 200.0


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


@pytest.fixture(scope="module")
def photograph() -> Floats:
    """A corner at (40.2, 39.9), noise that is alike in no way, a bright spot in one quarter."""
    grey = photograph_of(CENTRED) + np.random.default_rng(2).normal(0, 3, (80, 80))
    grey[46:49, 44:50] = 230
    return np.clip(np.rint(grey), 0, 255).astype(np.uint8)


HALF = np.array([[9.3, 8.1, np.inf, np.inf]])


def fitted(photograph: Floats, bends: Floats = BENDS, half: Floats = HALF) -> tuple[Floats, Floats]:
    p = CENTRED[None].copy()
    found = fit_corners(photograph, WHITE, p, bends[None], half, 5e-6, 60, examine=True)
    assert found[0, 0] == 0
    return p[0], found[0]


@pytest.fixture(scope="module")
def window(photograph: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Of the pixels within the window: row, column, derivatives, residual times the root of the weight."""
    return seen(photograph, fitted(photograph)[0], HALF[0])


def test_how_sure_a_place_is(photograph: Floats, window: tuple[Floats, ...]) -> None:
    p, found = fitted(photograph)
    _, _, derivatives, residual = window
    normal, gradient = normal_equations(p, derivatives, residual)
    inverse = np.linalg.inv(normal)
    assert found[3:6] == pytest.approx([inverse[0, 0], inverse[0, 1], inverse[1, 1]], rel=1e-4)
    # and nothing is left to be done
    assert np.abs(inverse @ gradient)[:4].max() < 1e-4


def test_how_a_place_follows_the_bend_of_its_edges() -> None:
    photograph = np.rint(200 * photograph_of(CENTRED)).astype(np.uint16)
    _, found = fitted(photograph)
    for edge in range(2):
        step = np.eye(2)[edge] * 1e-3
        (before, _), (after, _) = (fitted(photograph, BENDS + way * step) for way in (-1, 1))
        assert found[[6 + edge, 8 + edge]] == pytest.approx((after - before)[:2] / 2e-3, abs=0.5)  # of 15


def test_what_disturbs_it(photograph: Floats, window: tuple[Floats, ...]) -> None:
    p, found = fitted(photograph)
    row, column, derivatives, residual = window
    root = derivatives[5]
    x, y = column - p[0], row - p[1]
    sides = [y * np.cos(angle) > x * np.sin(angle) for angle in p[2:4]]
    quarters = [(sides[0] == one) & (sides[1] == other) for one in (False, True) for other in (False, True)]
    weights = np.array([(root[quarter] ** 2).sum() for quarter in quarters])
    saturated = root**2 * (photograph[row, column] >= WHITE)
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
