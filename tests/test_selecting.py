"""Views chosen by what they tell: better than chance, not from one place again and again, none that is wrong."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from worlds import SmallWorld

from opencsp_calib import Calibration, Camera, Checkerboard, InputError, Observations, compare, solve
from opencsp_calib.cli import run
from opencsp_calib.hdf5_calibration import load_calibration
from opencsp_calib.pipeline import select
from opencsp_calib.projection_sigma import sigma_map
from opencsp_calib.selecting import Selection
from opencsp_calib.synthetic import observe, random_poses

OPTIONS = {"solver": "opencv", "board_shape": "flat"}
SIZE, COUNT = 120, 12


@pytest.fixture(scope="module")
def pool() -> tuple[Camera, Observations]:
    world = SmallWorld.seeded()
    board = Checkerboard(9, 6, 0.03)
    poses = random_poses(board, world.camera, SIZE, rng=11)
    return world.camera, observe(world.camera, board, poses, noise_px=0.1, rng=12)


@pytest.fixture(scope="module")
def selection(pool: tuple[Camera, Observations]) -> Selection:
    return select(pool[1], COUNT, **OPTIONS)


quick = partial(solve, **OPTIONS)


def sigma_px(calibration: Calibration) -> float:
    return sigma_map(calibration, covariance=calibration.covariance_residual).rms_px


def test_chosen_views_tell_more_than_views_at_random(pool: tuple[Camera, Observations], selection: Selection) -> None:
    """By the uncertainty that the solution states, and by its distance from the truth."""
    truth, observations = pool
    assert (len(selection.observations.used), selection.of) == (COUNT, SIZE)
    chosen = quick(selection.observations)
    rng = np.random.default_rng(0)
    names = [view.image for view in observations.used]
    by_chance = [quick(observations.keeping(rng.choice(names, COUNT, replace=False))) for _ in range(5)]
    assert sigma_px(chosen) < 0.7 * np.mean([sigma_px(one) for one in by_chance])
    errors = [compare(one.camera, truth).rms_px for one in by_chance]
    assert compare(chosen.camera, truth).rms_px < np.mean(errors)
    everything = quick(observations)
    assert sigma_px(chosen) / sigma_px(everything) == pytest.approx(selection.loss, rel=0.25)


def test_the_others_are_dropped_with_the_reason(selection: Selection) -> None:
    dropped = [view for view in selection.observations.views if view.status == "dropped"]
    assert len(dropped) == SIZE - COUNT
    assert {view.problems[-1].code for view in dropped} == {"not-selected"}
    assert f"{COUNT} of {SIZE}" in dropped[0].problems[-1].message


def test_a_wrong_view_is_not_chosen_however_much_it_seems_to_tell(
    pool: tuple[Camera, Observations], selection: Selection
) -> None:
    _, observations = pool
    best = selection.observations.used[0]
    rng = np.random.default_rng(4)
    torn = replace(best.detection, pixels=best.detection.pixels + rng.normal(0, 4, best.detection.pixels.shape))
    views = tuple(replace(v, detection=torn) if v.image == best.image else v for v in observations.views)
    found = select(replace(observations, views=views), COUNT, **OPTIONS).observations
    (wrong,) = (view for view in found.views if view.image == best.image)
    assert (wrong.status, wrong.problems[-1].code) == ("dropped", "misfit")


def test_of_views_from_one_place_one_is_taken(pool: tuple[Camera, Observations], selection: Selection) -> None:
    """A video that stands still for a while, at a view that tells much."""
    _, observations = pool
    best = selection.observations.used[0]
    still = tuple(replace(best, image=f"still {index}") for index in range(20))
    found = select(replace(observations, views=(*observations.views, *still)), COUNT, **OPTIONS).observations
    same = [view.image for view in found.used if view.image.startswith("still") or view.image == best.image]
    assert len(same) <= 1


def test_as_many_as_there_are(pool: tuple[Camera, Observations]) -> None:
    found = select(pool[1], SIZE, **OPTIONS)
    assert found.observations is pool[1]
    assert found.loss == 1.0
    with pytest.raises(InputError, match="at least 3"):
        select(pool[1], 2, **OPTIONS)


def test_the_command_line_selects(photographs, tmp_path, capsys: pytest.CaptureFixture[str]) -> None:
    output = tmp_path / "camera.h5"
    command = ["calibrate", str(photographs), "--board", SmallWorld.spec, "-o", str(output), "--solver", "opencv"]
    assert run([*command, "--select", "8"]) == 0
    assert "8 of 12 views selected" in capsys.readouterr().err
    assert len(load_calibration(output).observations.used) == 8
    assert not (tmp_path / "camera.h5.journal").exists()
