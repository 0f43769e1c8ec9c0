"""Lens models against OpenCV's, pycolmap's and mrcal's own projections, and against numerical derivatives."""

import shutil
import subprocess

import cv2
import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from opencsp_calib import Camera, InputError
from opencsp_calib.models import LENS_MODELS
from opencsp_calib.models.base import inverse_radius

SIZE = (1626, 1236)
PINHOLE = [1400.0, 1410.0, 830.0, 601.0]
DISTORTION = {
    "pinhole": [],
    "opencv4": [-0.2, 0.1, 1e-3, -2e-3],
    "opencv5": [-0.2, 0.1, 1e-3, -2e-3, 0.03],
    "opencv8": [-0.2, 0.1, 1e-3, -2e-3, 0.03, 0.1, 0.02, 0.01],
    "opencv12": [-0.2, 0.1, 1e-3, -2e-3, 0.03, 0.1, 0.02, 0.01, 1e-3, -1e-3, 2e-3, 5e-4],
    "opencv14": [-0.2, 0.1, 1e-3, -2e-3, 0.03, 0.1, 0.02, 0.01, 1e-3, -1e-3, 2e-3, 5e-4, 0.02, -0.03],
    "opencv_fisheye": [0.02, -0.01, 0.003, -0.001],
}
OPENCV_ORDER = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "tau_x", "tau_y")
CAMERAS = {model: Camera("test", model, PINHOLE + d, SIZE) for model, d in DISTORTION.items()}

every_model = pytest.mark.parametrize("model", LENS_MODELS)


def test_every_lens_model_is_tested() -> None:
    assert set(CAMERAS) == set(LENS_MODELS)


@every_model
def test_parameters_are_called_and_ordered_as_opencv_documents_them(model: str) -> None:
    order = ("k1", "k2", "k3", "k4") if model == "opencv_fisheye" else OPENCV_ORDER[: len(DISTORTION[model])]
    assert LENS_MODELS[model].parameter_names == ("fx", "fy", "cx", "cy", *order)


def grid(size: tuple[int, int] = SIZE) -> np.ndarray:
    """Pixels over the whole image, its very corners included."""
    x, y = np.meshgrid(np.linspace(-0.5, size[0] - 0.5, 30), np.linspace(-0.5, size[1] - 0.5, 25))
    return np.column_stack([x.ravel(), y.ravel()])


def by_opencv(camera: Camera, points: np.ndarray) -> np.ndarray:
    zero = np.zeros(3)
    if camera.model == "opencv_fisheye":
        return cv2.fisheye.projectPoints(points[:, None], zero, zero, camera.matrix, camera.distortion)[0][:, 0]
    distortion = camera.distortion if camera.distortion.size else None
    return cv2.projectPoints(points, zero, zero, camera.matrix, distortion)[0].reshape(-1, 2)


@every_model
def test_projects_as_opencv_over_the_image(model: str) -> None:
    camera = CAMERAS[model]
    rays = camera.unproject(grid())
    assert np.isfinite(rays).all()
    np.testing.assert_allclose(camera.project(rays * 3.7), by_opencv(camera, rays * 3.7), rtol=0, atol=1e-9)


@every_model
def test_unprojects_to_unit_vectors_that_project_back(model: str) -> None:
    camera = CAMERAS[model]
    rays = camera.unproject(grid())
    np.testing.assert_allclose(np.linalg.norm(rays, axis=1), 1.0, rtol=0, atol=1e-14)
    np.testing.assert_allclose(by_opencv(camera, rays), grid(), rtol=0, atol=2e-9)


@pytest.mark.parametrize(
    ("model", "theirs"),
    [("pinhole", "PINHOLE"), ("opencv4", "OPENCV"), ("opencv8", "FULL_OPENCV"), ("opencv_fisheye", "OPENCV_FISHEYE")],
)
def test_projects_as_colmap_half_a_pixel_off(model: str, theirs: str) -> None:
    pycolmap = pytest.importorskip("pycolmap", reason="pip install 'opencsp-calib[colmap]'")
    camera = CAMERAS[model]
    params = camera.params.copy()
    params[2:4] += 0.5  # COLMAP counts from the upper-left corner of the upper-left pixel
    colmap = pycolmap.Camera(model=theirs, width=SIZE[0], height=SIZE[1], params=params)
    rays = camera.unproject(grid())
    np.testing.assert_allclose(camera.project(rays), colmap.img_from_cam(rays) - 0.5, rtol=0, atol=1e-9)


MRCALS = ("pinhole", "opencv4", "opencv5", "opencv8", "opencv12")
MRCAL_PROJECTS = """
import sys, numpy as np, mrcal
for model in sys.argv[1:]:
    rays, params = np.load(f"rays_{model}.npy"), np.load(f"params_{model}.npy")
    np.save(f"pixels_{model}.npy", mrcal.project(rays, f"LENSMODEL_{model.upper()}", params))
"""


@pytest.fixture(scope="module")
def by_mrcal(tmp_path_factory: pytest.TempPathFactory) -> dict[str, np.ndarray]:
    """The pixels where mrcal, of Debian's Python, projects the rays of :func:`grid` with each model that it has too."""
    python = shutil.which("python3", path="/usr/bin")
    if python is None or subprocess.run([python, "-c", "import mrcal"], capture_output=True).returncode:
        pytest.skip("Debian's mrcal is not installed")
    folder = tmp_path_factory.mktemp("mrcal")
    for model in MRCALS:
        np.save(folder / f"rays_{model}.npy", CAMERAS[model].unproject(grid()))
        np.save(folder / f"params_{model}.npy", CAMERAS[model].params)
    subprocess.run([python, "-c", MRCAL_PROJECTS, *MRCALS], cwd=folder, check=True)
    return {model: np.load(folder / f"pixels_{model}.npy") for model in MRCALS}


@pytest.mark.parametrize("model", MRCALS)
def test_projects_as_mrcal(model: str, by_mrcal: dict[str, np.ndarray]) -> None:
    camera = CAMERAS[model]
    np.testing.assert_allclose(camera.project(camera.unproject(grid())), by_mrcal[model], rtol=0, atol=1e-9)


@every_model
def test_jacobians_are_the_slopes(model: str) -> None:
    camera = CAMERAS[model]
    points = camera.unproject(grid()[::7]) * np.linspace(0.3, 4, len(grid()[::7]))[:, None]
    pixels, by_point, by_params = camera.lens.project_with_jacobians(points, camera.params)
    np.testing.assert_array_equal(pixels, camera.project(points))
    for axis in range(3):
        step = np.eye(3)[axis] * 1e-6
        slope = (camera.project(points + step) - camera.project(points - step)) / 2e-6
        np.testing.assert_allclose(by_point[:, :, axis], slope, rtol=1e-6, atol=2e-5)
    for index, value in enumerate(camera.params):
        step = np.zeros_like(camera.params)
        step[index] = 1e-6 * max(1.0, abs(value))
        ahead, behind = (camera.lens.project(points, camera.params + sign * step) for sign in (1, -1))
        slope = (ahead - behind) / (2 * step[index])
        np.testing.assert_allclose(by_params[:, :, index], slope, rtol=1e-6, atol=2e-5)


@every_model
def test_along_its_ray_a_point_stays_where_it_is_seen(model: str) -> None:
    """By Euler, of any projection: its derivative by the point, times the point, is nothing. Near the axis too."""
    near = np.array([[5e-5, -3e-5, 1.0], [1e-6, 0.0, 1.0], [0.3, 0.2, 1.0]])
    points = np.concatenate([near * scale for scale in (0.01, 0.5, 2.0, 30.0)])
    _, by_point, _ = CAMERAS[model].lens.project_with_jacobians(points, CAMERAS[model].params)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", by_point, points), 0.0, rtol=0, atol=1e-9)


def test_fisheye_jacobian_is_smooth_on_the_axis_and_right_behind_the_camera() -> None:
    camera = CAMERAS["opencv_fisheye"]
    points = np.array([[0, 0, 2.0], [1e-9, 0, 2.0], [9e-5, 9e-5, 1.0], [2e-4, -1e-4, 1.0], [1.0, 0.3, -0.2], [1, 1, 0]])
    _, by_point, _ = camera.lens.project_with_jacobians(points, camera.params)
    for axis in range(3):
        step = np.eye(3)[axis] * 1e-6
        slope = (camera.project(points + step) - camera.project(points - step)) / 2e-6
        np.testing.assert_allclose(by_point[:, :, axis], slope, rtol=1e-5, atol=1e-4)


def test_what_has_no_image_is_nan() -> None:
    folding = Camera("folds", "opencv4", [1000, 1000, 800, 600, -0.4, 0.0, 0, 0], SIZE)
    radius = folding.valid_radius
    assert radius == pytest.approx(1 / np.sqrt(1.2))  # d/dr (r - 0.4 r³) = 0
    points = np.array(
        [[0, 0, -1.0], [0, 0, 0], [1, 0, 0], [radius * 1.001, 0, 1], [radius * 0.999, 0, 1], [np.nan, 0, 1]]
    )
    assert np.isnan(folding.project(points)).all(axis=1).tolist() == [True, True, True, True, False, True]
    beyond = 800 + 1000 * (radius - 0.4 * radius**3) + 1
    assert np.isnan(folding.unproject([[beyond, 600.0]])).all()
    assert np.isfinite(folding.unproject([[beyond - 2, 600.0]])).all()


def test_a_pole_of_the_rational_model_ends_its_validity() -> None:
    camera = Camera("pole", "opencv8", [1000, 1000, 800, 600, 0, 0, 0, 0, 0, -1.0, 0, 0], SIZE)
    assert camera.valid_radius == pytest.approx(1.0)


@every_model
def test_up_to_the_largest_angle_there_is_an_image(model: str) -> None:
    camera = CAMERAS[model]
    largest, around = camera.lens.max_angle(camera.distortion), np.linspace(0, 2 * np.pi, 9)
    for angle, seen in ((largest - 1e-6, True), (largest + 1e-6, False)):
        z = np.full(9, np.cos(angle))
        rays = np.column_stack([np.sin(angle) * np.cos(around), np.sin(angle) * np.sin(around), z])
        assert (np.isfinite(camera.project(rays)) == seen).all()


def test_fisheye_sees_beside_and_behind_but_not_where_it_folds() -> None:
    camera = CAMERAS["opencv_fisheye"]
    limit = camera.valid_radius
    assert np.pi / 2 < limit < np.pi
    angles = np.array([np.pi / 2, limit - 1e-3, limit + 1e-3])
    rays = np.column_stack([np.sin(angles), np.zeros(3), np.cos(angles)])
    assert np.isnan(camera.project(rays)).all(axis=1).tolist() == [False, False, True]
    back = camera.unproject(camera.project(rays[:2]))
    np.testing.assert_allclose(back, rays[:2], atol=1e-9)
    assert np.isnan(camera.project([[0.0, 0.0, -1.0]])).all()


@settings(max_examples=60)
@given(
    k=st.lists(st.floats(-0.3, 0.3), min_size=3, max_size=3),
    p=st.lists(st.floats(-0.01, 0.01), min_size=2, max_size=2),
    f=st.floats(300, 5000),
    model=st.sampled_from(["opencv5", "opencv_fisheye"]),
)
def test_unproject_undoes_project_wherever_there_is_an_image(k: list, p: list, f: float, model: str) -> None:
    distortion = [k[0], k[1], *p, k[2]] if model == "opencv5" else [*k, 0.01]
    camera = Camera("any", model, [f, 1.01 * f, 800, 600, *distortion], SIZE)
    rays = camera.unproject(grid())
    seen = np.isfinite(rays).all(axis=1)
    np.testing.assert_allclose(camera.project(rays[seen]), grid()[seen], rtol=0, atol=2e-9)


@settings(max_examples=30)
@example(k=(-0.125, 0.0, 4e-53), p=(0.0, 0.0))  # a term next to nothing hid where the image folds
@example(k=(0.0, 0.0, -3.02e-97), p=(0.0, 8.36e-4))  # nor is that so far out that rays are looked for too far
@given(k=st.tuples(*[st.floats(-0.3, 0.3)] * 3), p=st.tuples(*[st.floats(-0.001, 0.001)] * 2))
def test_unproject_finds_all_that_is_seen_where_the_image_is_not_nearly_folded(k: tuple, p: tuple) -> None:
    camera = Camera("any", "opencv5", [1000, 1010, 800, 600, k[0], k[1], *p, k[2]], SIZE)
    radii = np.linspace(0, min(0.9 * camera.valid_radius, 1.5), 200)
    assume((1 + 3 * k[0] * radii**2 + 5 * k[1] * radii**4 + 7 * k[2] * radii**6).min() > 0.1)
    around = np.arange(200)
    points = np.column_stack([radii * np.cos(around), radii * np.sin(around), np.ones(200)])
    rays = points / np.linalg.norm(points, axis=1, keepdims=True)
    np.testing.assert_allclose(camera.unproject(camera.project(points)), rays, rtol=0, atol=1e-9)


def test_an_unknown_model_names_those_there_are() -> None:
    with pytest.raises(InputError, match=r"'opencv6'.*pinhole, opencv4, opencv5"):
        Camera("x", "opencv6", PINHOLE, SIZE)


@pytest.mark.parametrize("slope", [0.01, 1.0, 20.0])
def test_a_radius_is_found_however_far_the_lens_moves_it(slope: float) -> None:
    """Newton's method starts from it, and mends much: only the start itself tells whether the search reaches it."""
    radii = np.array([0.0, 1e-5, 0.3, 70.0])
    found = inverse_radius(slope * radii, lambda radius: slope * radius, np.inf)
    np.testing.assert_allclose(found, radii, rtol=1e-6, atol=1e-4)
    assert inverse_radius(slope * radii, lambda radius: slope * radius, 2.0)[-1] == pytest.approx(2.0)
