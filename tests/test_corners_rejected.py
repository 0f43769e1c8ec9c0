"""Corners not to be trusted are rejected, each with its reason: covered, in glare, cut off, or no corners at all."""

import cv2
import numpy as np
import pytest
from corner_views import BOARD, SIZE, rms, view
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from opencsp_calib import Detection, Image, InputError
from opencsp_calib.corners import refine
from opencsp_calib.rendering import Scene, Spot


@pytest.mark.parametrize("level", [20.0, 90.0, 190.0, 250.0])
@pytest.mark.parametrize("radius_px", [3.0, 8.0, 20.0])
def test_what_is_covered_is_rejected_and_what_is_not_is_kept(level: float, radius_px: float) -> None:
    plain = view(seed=3)
    spots = tuple(Spot(*(plain.truth[i] + [1.0, 0.5]), radius_px, level) for i in (14, 40, 62))
    seen = view(seed=3, scene=Scene(occluders=spots))
    refined = refine(seen.image, seen.found(), seen.board)
    distance = np.min([np.hypot(*(seen.truth - [s.x_px, s.y_px]).T) for s in spots], axis=0)
    if radius_px > 5:  # less leaves most of the edges to be seen, and they are enough
        assert not {14, 40, 62} & set(refined.ids.tolist())
    assert (seen.squared_over_stated(refined) < 15).all()
    assert set(np.flatnonzero(distance > radius_px + 24)) <= set(refined.ids.tolist())
    assert np.linalg.norm(seen.errors(refined), axis=1).max() < 0.3
    assert all(corner.reason for corner in refined.rejected)
    if refined.rejected:
        assert refined.reason.startswith(f"{len(refined.rejected)} of 88 corners rejected: ")


@pytest.mark.parametrize(("level", "radius_px"), [(30.0, 40.0), (60.0, 12.0), (300.0, 30.0)])
def test_reflections_are_modelled_or_named(level: float, radius_px: float) -> None:
    plain = view(seed=4)
    spot = Spot(*plain.truth[38], radius_px, level)
    seen = view(seed=4, scene=Scene(glare=(spot,)))
    refined = refine(seen.image, seen.found(), seen.board)
    assert seen.squared_over_stated(refined).mean() < 1.5
    assert np.linalg.norm(seen.errors(refined), axis=1).max() < 0.25
    if level > 200:
        assert 38 not in refined.ids
        assert {corner.reason for corner in refined.rejected if corner.id == 38} == {"glare"}


def test_corners_at_the_image_border_are_named() -> None:
    seen = view(middle=(0.2, 0.5))
    inside = np.all((seen.truth > 0) & (seen.truth < np.array(SIZE) - 1), axis=1)
    close = inside & (np.min([seen.truth, np.array(SIZE) - 1 - seen.truth], axis=(0, 2)) < 2)
    refined = refine(seen.image, seen.found(0.1).keeping(inside), seen.board)
    reasons = {corner.id: corner.reason for corner in refined.rejected}
    assert close.any()
    assert all(reasons[i] == "at the image border" for i in np.flatnonzero(close))
    assert rms(seen.errors(refined)) < 0.008


def test_narrow_outer_squares_only_make_the_window_smaller() -> None:
    scene = Scene(margin_squares=0.05, background=20.0, clutter=0.0)
    seen = view(scene=scene)
    cut = seen.image.pixels.copy()
    quarter = np.round(0.45 * (seen.truth[0] - seen.truth[1])).astype(int)
    mask = np.zeros(cut.shape, np.uint8)
    rim = np.array([seen.truth[0], seen.truth[77]]) + quarter
    cv2.fillPoly(mask, [np.vstack([rim, rim[::-1] + 3 * quarter]).round().astype(np.int32)], 1)
    cut[mask > 0] = 240
    refined = refine(Image("cut", cut), seen.found(), seen.board)
    first_column = np.arange(0, 88, 11)
    assert np.isin(first_column[1:-1], refined.ids).all(), refined.reason
    assert np.linalg.norm(seen.errors(refined), axis=1).max() < 0.1


def test_corners_of_the_other_colour_and_of_other_places_are_rejected() -> None:
    seen = view()
    pixels = seen.truth.copy()
    pixels[37] = seen.truth[38]  # a corner, but another one
    pixels[60] = (seen.truth[60] + seen.truth[61]) / 2  # on an edge
    pixels[70] = (seen.truth[70] + seen.truth[82]) / 2  # in the middle of a square
    refined = refine(seen.image, Detection(np.arange(88), pixels), seen.board)
    assert not {37, 60, 70} & set(refined.ids.tolist())
    reasons = {corner.id: corner.reason for corner in refined.rejected}
    assert reasons[37] == "black and white are exchanged"


def test_a_lonely_corner_has_no_known_size() -> None:
    seen = view()
    refined = refine(seen.image, seen.found().keeping(np.arange(88) == 30), seen.board)
    assert [corner.reason for corner in refined.rejected] == ["no corner beside it tells how large its squares are"]


@pytest.mark.parametrize("level", [0, 128, 255])
@pytest.mark.parametrize("size", [(20, 20), (200, 150), (1, 1), (3, 400)])
def test_an_image_of_one_level_has_no_corners(level: int, size: tuple[int, int]) -> None:
    image = Image("flat", np.full(size[::-1], level, dtype=np.uint8))
    x, y = np.meshgrid(np.linspace(0, size[0] - 1, 11), np.linspace(0, size[1] - 1, 8))
    refined = refine(image, Detection(np.arange(88), np.column_stack([x.ravel(), y.ravel()])), BOARD)
    assert len(refined) == 0
    assert len(refined.rejected) == 88


@settings(max_examples=40)
@given(data=st.data())
def test_nonsense_is_rejected_and_never_raises(data: st.DataObject) -> None:
    dtype = data.draw(st.sampled_from([np.uint8, np.uint16]))
    shape = data.draw(st.tuples(st.integers(1, 60), st.integers(1, 60)))
    pixels = data.draw(
        hnp.arrays(dtype, shape, fill=st.just(dtype(0)))
        | st.integers(0, 99).map(lambda s: np.random.default_rng(s).integers(0, 256, shape).astype(dtype))
    )
    n = data.draw(st.integers(1, 12))
    ids = data.draw(hnp.arrays(np.int64, n, elements=st.integers(0, 87), unique=True))
    where = data.draw(hnp.arrays(np.float64, (n, 2), elements=st.floats(-1e6, 1e6) | st.floats(0, 60)))
    refined = refine(Image("nonsense", pixels), Detection(ids, where), BOARD)
    assert len(refined) + len(refined.rejected) == n
    assert np.isfinite(refined.pixels).all()
    assert np.isfinite(refined.covariance).all()


def test_nothing_stays_nothing_and_strange_ids_are_named() -> None:
    image = Image("flat", np.zeros((9, 9), dtype=np.uint8))
    nothing = Detection.nothing("no board")
    assert refine(image, nothing, BOARD) is nothing
    with pytest.raises(InputError, match="11x8"):
        refine(image, Detection([88], [[1.0, 1.0]]), BOARD)
