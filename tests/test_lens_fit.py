"""Fits to projections whose best approximation is known: a model of ours, or the published cost of an approximation."""

import numpy as np
import pytest

from opencsp_calib import Camera, InputError
from opencsp_calib.lens_fit import fit, seen
from opencsp_calib.models import LENS_MODELS

TERMS = {
    "opencv_fisheye": [-0.01, 1e-3, 1e-4, -2e-5],
    "opencv14": [-0.3, 0.1, 1e-3, -2e-3, 0.01, 0.02, 0.03, 4e-3, 1e-3, 1e-4, 2e-3, 3e-4, 0.01, -0.02],
}


def camera_of(model: str) -> Camera:
    count = len(LENS_MODELS[model].distortion_names)
    terms = TERMS.get(model, TERMS["opencv14"])[:count]
    return Camera("a", model, np.array([500.25, 501.5, 322.0, 237.0, *terms]), (640, 480))


def division(k: float, f: float = 1200.0, size: tuple[int, int] = (1920, 1080)):
    """The division model, solved for the distorted radius."""

    def project(points):
        plane = points[:, :2] / np.where(points[:, 2:] > 0, points[:, 2:], np.nan)
        r2 = (plane**2).sum(axis=1, keepdims=True)
        return f * 2 * plane / (1 + np.sqrt(1 - 4 * k * r2)) + np.array(size) / 2

    return project


@pytest.mark.parametrize("model", sorted(LENS_MODELS))
def test_our_own_models_are_found_again(model: str) -> None:
    truth = camera_of(model)
    found = fit(truth.project, truth.image_size, model, name="b")
    assert found.worst_px < 1e-9
    assert found.rms_px <= found.worst_px
    assert found.coverage == 1.0
    assert (found.camera.name, found.camera.image_size) == ("b", truth.image_size)
    x, y = np.meshgrid(np.linspace(-0.5, 639.5, 50), np.linspace(-0.5, 479.5, 40))
    rays = truth.unproject(np.column_stack([x.ravel(), y.ravel()]))
    np.testing.assert_allclose(found.camera.project(rays), truth.project(rays), rtol=0, atol=1e-8)


@pytest.mark.parametrize(
    ("k", "model", "rms", "worst"),
    [(-0.05, "opencv5", 1.5e-4, 1.5e-3), (-0.05, "opencv8", 2e-8, 1e-7), (-0.2, "opencv5", 0.05, 0.4),
     (-0.2, "opencv8", 3e-7, 3e-6)],
)  # fmt: skip
def test_division_costs_what_others_measured(k: float, model: str, rms: float, worst: float) -> None:
    """By another least-squares fit over the image: 1e-4, 1e-8, 0.034 and 2e-7 px rms."""
    found = fit(division(k), (1920, 1080), model)
    assert found.rms_px < rms
    assert found.worst_px < worst


def test_the_error_stated_is_the_error_over_the_image() -> None:
    """Compared on a finer grid of pixels, whose rays come from the division model's own formula the easy way round."""
    k, f = -0.2, 1200.0
    found = fit(division(k), (1920, 1080), "opencv5")
    x, y = np.meshgrid(np.linspace(-0.5, 1919.5, 300), np.linspace(-0.5, 1079.5, 200))
    pixels = np.column_stack([x.ravel(), y.ravel()])
    distorted = (pixels - [960, 540]) / f
    rays = np.column_stack([distorted, 1 + k * (distorted**2).sum(axis=1)])
    errors = np.linalg.norm(found.camera.project(rays) - pixels, axis=1)
    assert errors.max() == pytest.approx(found.worst_px, rel=0.05)
    assert np.sqrt((errors**2).mean()) == pytest.approx(found.rms_px, rel=0.2)


def test_the_frame_is_not_turned_to_hide_an_error() -> None:
    """A camera that looks a little askew is off by that much, however well a turned one would fit."""
    truth = camera_of("pinhole")
    turn = np.array([[np.cos(0.05), 0, np.sin(0.05)], [0, 1, 0], [-np.sin(0.05), 0, np.cos(0.05)]])
    found = fit(lambda points: truth.project(points @ turn.T), truth.image_size, "pinhole")
    assert found.worst_px > 5.0


def test_a_fisheye_with_black_corners_is_fitted_to_its_circle() -> None:
    truth = Camera("a", "opencv_fisheye", np.array([300.0, 301, 1000, 1020, -0.01, 1e-3, 1e-4, -2e-5]), (2000, 2000))
    found = fit(truth.project, truth.image_size, "opencv_fisheye")
    assert found.worst_px < 1e-9
    limit = truth.lens.max_angle(truth.distortion)
    edge = truth.project(np.array([[np.sin(limit * 0.999999), 0, np.cos(limit * 0.999999)]]))[0, 0] - 1000
    assert found.coverage == pytest.approx(np.pi * edge**2 / 2000**2, rel=0.05)
    narrow = fit(truth.project, truth.image_size, "opencv_fisheye", max_angle=np.radians(60))
    assert narrow.coverage < 0.7 * found.coverage


def test_a_model_of_the_plane_cannot_show_what_is_beside_the_camera() -> None:
    truth = Camera("a", "opencv_fisheye", np.array([200.0, 200, 500, 400, 0, 0, 0, 0]), (1000, 800))
    with pytest.raises(InputError, match=r"opencv8 cannot show what is 1.. degrees off the axis"):
        fit(truth.project, truth.image_size, "opencv8")


def test_a_start_that_is_given() -> None:
    truth = camera_of("opencv8")
    assert fit(truth.project, truth.image_size, "opencv8", truth.params + 1e-3).worst_px < 1e-6
    with pytest.raises(InputError, match="start of the fit"):
        fit(truth.project, truth.image_size, "opencv8", np.array([500.0, 500, 320, 240, -9, 0, 0, 0, 0, 0, 0, 0]))


@pytest.mark.parametrize("project", [lambda p: np.full((len(p), 2), np.nan), lambda p: np.full((len(p), 2), 1e9)])
def test_nothing_to_see(project) -> None:
    with pytest.raises(InputError, match="shows"):
        fit(project, (640, 480), "pinhole")


def test_extremes_of_size() -> None:
    for size, f in (((4, 4), 3.0), ((6000, 4000), 50_000.0), ((100_000, 2), 1e5)):
        truth = Camera("a", "opencv4", np.array([f, f, size[0] / 2, size[1] / 2, -0.05, 0.01, 0, 0]), size)
        assert fit(truth.project, size, "opencv4").worst_px < 1e-6


def test_pixels_are_exactly_where_their_rays_are_projected() -> None:
    truth = camera_of("opencv5")
    rays, pixels, coverage = seen(truth.project, truth.image_size)
    assert coverage == 1.0
    assert np.array_equal(truth.project(rays), pixels)
    np.testing.assert_allclose(np.linalg.norm(rays, axis=1), 1.0, rtol=1e-12)
    assert pixels.min() == pytest.approx(-0.5, abs=1.0)
    assert pixels.max(axis=0) == pytest.approx([639.5, 479.5], abs=1.0)
