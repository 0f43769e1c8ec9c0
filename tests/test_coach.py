"""The coach: what it says of views whose truth is known, and that the view it asks for is worth most."""

import numpy as np
import pytest

from opencsp_calib import Camera, Checkerboard, Pose
from opencsp_calib.coach import Knowledge, learn, sketch
from opencsp_calib.coach.lacking import lacks
from opencsp_calib.coach.next_view import candidates
from opencsp_calib.coach.preview import motion_px
from opencsp_calib.coach.wording import described, tilted_side
from opencsp_calib.comparison import compare
from opencsp_calib.detection import Detection
from opencsp_calib.synthetic import observe, pose_in_view, random_poses, seed_poses, turned

BOARD = Checkerboard(9, 6, 0.03)
CAMERA = Camera("small", "opencv4", [800.0, 800.0, 330.0, 236.0, -0.12, 0.05, 1e-3, -5e-4], (640, 480))


def knowledge_of(poses, **options) -> Knowledge:
    seen = observe(CAMERA, BOARD, poses, noise_px=0.05, rng=1)
    return learn(BOARD, CAMERA.image_size, seen.views, **options)


def shown(tilt_deg, azimuth_deg=0.0, roll_deg=0.0, fill=0.6, place=(0.5, 0.5)) -> Pose:
    rotation = turned(np.radians(tilt_deg), np.radians(azimuth_deg), np.radians(roll_deg))
    return pose_in_view(BOARD, CAMERA, rotation, fill, place)


def test_a_rough_camera_before_anything_is_known():
    nothing = learn(BOARD, CAMERA.image_size)
    assert nothing.next_view is not None
    assert 25 < nothing.next_view.pose.tilt_deg < 50
    assert (nothing.progress, nothing.done) == (0.0, False)
    assert [lack.code for lack in nothing.lacks] == ["views", "tilt", "orientation", "coverage", "range"]
    few = knowledge_of(seed_poses(BOARD, CAMERA, 2))
    assert few.calibration is None
    assert "2 more views" in few.why_not
    assert few.camera.params[0] == pytest.approx(800, rel=0.2)


def test_a_good_set_is_done():
    good = knowledge_of(seed_poses(BOARD, CAMERA, 27, rng=2), goal_px=0.2)
    assert good.camera.params[0] == pytest.approx(800, abs=2)
    assert good.lacks == ()
    assert good.done
    assert good.progress == 1.0
    assert not knowledge_of(seed_poses(BOARD, CAMERA, 20, rng=2), goal_px=1e-4).done


def test_its_uncertainty_is_honest():
    """How far the camera it has is from the true one is within three of its sigmas, whatever the number of views."""
    for views in (6, 12, 24):
        known = knowledge_of(seed_poses(BOARD, CAMERA, views, rng=views))
        assert compare(CAMERA, known.camera).rms_px < 3 * known.sigma_px


def test_the_view_asked_for_is_worth_more_than_nearly_all_others():
    known = knowledge_of(seed_poses(BOARD, CAMERA, 5, rng=3))
    gains = [known.gain_of(pose) for pose in random_poses(BOARD, CAMERA, 40, 4)]
    assert known.next_view.gain > np.quantile(gains, 0.8)
    assert known.gain_of(known.next_view.pose) == pytest.approx(known.next_view.gain, rel=1e-6)


@pytest.mark.parametrize(
    ("poses", "code", "words"),
    [
        ([shown(35, 40 * k) for k in range(12)], "orientation", "hold the board vertical: 12 views are horizontal"),
        ([shown(35, 40 * k, 90) for k in range(12)], "orientation", "hold the board horizontal"),
        ([shown(5, 40 * k, 90 * (k % 2)) for k in range(12)], "tilt", "30 to 45 degrees: 0 of 12"),
        ([shown(35, 40 * k, 90 * (k % 2), place=(0, 0)) for k in range(12)], "coverage", "lower right"),
        ([shown(35, 90, fill=0.6) for k in range(12)], "range", "go nearer or farther: all views are"),
    ],
)
def test_what_is_missing_is_said_and_asked_for(poses, code, words):
    """And the view asked for next brings it."""
    missing = {lack.code: lack for lack in lacks(observe(CAMERA, BOARD, poses), poses)}
    assert words in missing[code].message
    asked = knowledge_of(poses).next_view
    assert missing[code].helped_by(CAMERA, BOARD, asked.pose)


def test_nothing_is_missing_from_the_seeds_procedure():
    poses = seed_poses(BOARD, CAMERA, 27)
    assert lacks(observe(CAMERA, BOARD, poses), poses) == ()


@pytest.mark.parametrize(
    ("azimuth_deg", "side"),
    [(90, "left side"), (-90, "right side"), (0, "lower side"), (180, "upper side"), (135, "upper left corner")],
)
def test_the_side_named_is_the_one_that_is_far(azimuth_deg, side):
    """By the depths of its farthest and its nearest corner."""
    pose = shown(35, azimuth_deg)
    points = pose.transform(BOARD.points)
    far, near = points[points[:, 2].argmax()], points[points[:, 2].argmin()]
    for word, axis, sign in (("right", 0, 1), ("left", 0, -1), ("lower", 1, 1), ("upper", 1, -1)):
        if word in side:
            assert sign * (far - near)[axis] > 0
    assert tilted_side(BOARD, pose) == side


def test_a_view_in_words():
    words = described(CAMERA, BOARD, shown(40, 90, 90, fill=0.5, place=(0, 0)))
    assert words.startswith("vertical, in the upper left part of the image, 1.14 m away")
    assert words.endswith("its left side turned away by 40 degrees")


def test_the_sketch_has_the_outline_where_it_is():
    square = np.array([[320.0, 240.0], [639.0, 240.0], [639.0, 479.0], [320.0, 479.0]])
    lines = sketch({"#": square}, (640, 480), columns=32)
    rows = [row for row, line in enumerate(lines) if "#" in line]
    assert (rows[0], rows[-1]) == (len(lines) // 2, len(lines) - 2)
    assert lines[rows[0]] == "|" + " " * 16 + "#" * 16 + "|"
    unseen = sketch({"#": np.full((3, 2), np.nan)}, (640, 480), columns=32)
    assert len(unseen) == len(lines)
    assert "#" not in "".join(unseen)


def test_candidates_show_the_whole_board_as_the_procedure_asks():
    for pose in candidates(CAMERA, BOARD).poses:
        pixels = CAMERA.project(pose.transform(BOARD.points))
        assert ((pixels > 0) & (pixels < np.array(CAMERA.image_size) - 1)).all()
        assert 29.9 < pose.tilt_deg < 45.1


def test_motion_is_told_through_the_noise_of_corners():
    rng = np.random.default_rng(0)
    pixels = observe(CAMERA, BOARD, [shown(35)]).detections[0].pixels
    ids = np.arange(len(pixels))
    noise = 0.7 * rng.normal(size=(2, *pixels.shape))
    before = Detection(ids, pixels + noise[0])
    assert motion_px(before, Detection(ids, pixels + noise[1])) < 0.7
    angle = 0.02
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    middle = pixels.mean(axis=0)
    turned_pixels = (pixels - middle) @ turn.T + middle
    expected = np.sqrt(((turned_pixels - pixels) ** 2).sum(axis=1).mean())
    assert motion_px(before, Detection(ids, turned_pixels + noise[1])) == pytest.approx(expected, abs=0.5)
    assert np.isnan(motion_px(before, before.keeping(ids < 3)))


def test_views_that_are_all_the_same_are_no_camera_but_no_crash():
    known = knowledge_of([shown(0)] * 5)
    assert known.calibration is None
    assert known.why_not.startswith("the views do not tell the camera yet")
    assert known.next_view is not None
