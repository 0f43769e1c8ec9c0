"""Projections that are none of our models, against other programs' implementations and formulas written again here."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from opencsp_calib_formats.lens import (
    brown,
    division,
    double_sphere,
    equidistant,
    equisolid,
    eucm,
    fov,
    inverse_brown,
    ocam,
    omni,
    on_plane,
    to_pixels,
)
from opencsp_calib_formats.lens.brown import brown_with_jacobian, fold

pycolmap = pytest.importorskip("pycolmap")


def fan(max_deg: float) -> np.ndarray:
    """Directions evenly over a cone, the axis among them."""
    theta, phi = np.meshgrid(np.radians(np.linspace(0, max_deg, 40)), np.linspace(0, 2 * np.pi, 24, endpoint=False))
    sine = np.sin(theta)
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), np.cos(theta)], axis=-1).reshape(-1, 3)


def colmap(model: str, params: list[float], points: np.ndarray) -> np.ndarray:
    """Pixels in our convention of pycolmap's implementation."""
    camera = pycolmap.Camera(camera_id=1, model=model, width=1000, height=800, params=params)
    return np.array([camera.img_from_cam(p) for p in points]) - 0.5


FX, FY, CX, CY = 500.0, 510.0, 499.0, 401.5
FRONT = [FX, FY, CX + 0.5, CY + 0.5]

COLMAP_CASES = {
    "FOV": ([*FRONT, 0.93], lambda p: fov(on_plane(p), 0.93), 70),
    "EUCM": ([*FRONT, 0.6, 1.07], lambda p: eucm(p, 0.6, 1.07), 85),
    "DIVISION": ([*FRONT, -0.12], lambda p: division(on_plane(p), -0.12), 70),
    "THIN_PRISM_FISHEYE": (
        [*FRONT, 0.01, -0.02, 1e-3, -2e-3, 3e-3, -1e-3, 2e-3, -3e-3],
        lambda p: brown(equidistant(p), (0.01, -0.02, 3e-3, -1e-3), (1e-3, -2e-3), (2e-3, 0, -3e-3, 0)),
        80,
    ),
    "RAD_TAN_THIN_PRISM_FISHEYE": (
        [*FRONT, 0.01, -0.02, 3e-3, -1e-3, 2e-4, -1e-5, 1e-3, -2e-3, 2e-3, 1e-3, -3e-3, 2e-4],
        lambda p: brown(
            brown(equidistant(p), (0.01, -0.02, 3e-3, -1e-3, 2e-4, -1e-5)),
            (),
            (-2e-3, 1e-3),
            (2e-3, 1e-3, -3e-3, 2e-4),
        ),
        80,
    ),
}


@pytest.mark.parametrize("model", COLMAP_CASES)
def test_equals_colmap(model: str) -> None:
    params, formula, angle = COLMAP_CASES[model]
    points = fan(angle)
    np.testing.assert_allclose(
        to_pixels(formula(points), FX, FY, CX, CY), colmap(model, params, points), rtol=0, atol=1e-9
    )


def test_omni_with_radial_and_tangential_terms_equals_opencv() -> None:
    points, d, xi, skew = fan(85), (-0.2, 0.05, 1e-3, -2e-3), 1.2, 1.5
    camera_matrix = np.array([[FX, skew, CX], [0, FY, CY], [0, 0, 1.0]])
    expected, _ = cv2.omnidir.projectPoints(
        points[:, None].copy(), np.zeros(3), np.zeros(3), camera_matrix, xi, np.array(d)
    )
    ours = to_pixels(brown(omni(points, xi), d[:2], d[2:]), FX, FY, CX, CY, skew)
    seen = np.isfinite(ours).all(axis=1)
    assert seen.mean() > 0.9
    np.testing.assert_allclose(ours[seen], expected[:, 0][seen], rtol=0, atol=1e-9)


def test_brown_with_all_its_terms_equals_opencv() -> None:
    points = fan(30)
    d = np.array([-0.2, 0.1, 1e-3, -2e-3, 0.02, 0, 0, 0, 1e-3, 2e-3, -1e-3, 3e-3])
    expected, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), np.eye(3), d)
    ours = brown(on_plane(points), d[[0, 1, 4]], d[2:4], d[8:])
    np.testing.assert_allclose(ours, expected[:, 0], rtol=0, atol=1e-13)


def test_brown_of_metashape_with_its_further_terms() -> None:
    x, y = on_plane(fan(40)).T
    k, (p1, p2, p3, p4) = (-0.1, 0.05, -0.02, 0.01), (1e-3, -2e-3, 0.3, -0.1)
    r = np.hypot(x, y)
    radial = 1 + k[0] * r**2 + k[1] * r**4 + k[2] * r**6 + k[3] * r**8
    growth = 1 + p3 * r**2 + p4 * r**4
    expected_x = x * radial + (p1 * (r**2 + 2 * x**2) + 2 * p2 * x * y) * growth  # Metashape's p1 is OpenCV's p2
    expected_y = y * radial + (p2 * (r**2 + 2 * y**2) + 2 * p1 * x * y) * growth
    ours = brown(np.column_stack([x, y]), k, (p2, p1, p3, p4))
    np.testing.assert_allclose(ours, np.column_stack([expected_x, expected_y]), rtol=0, atol=1e-14)


def test_brown_ends_where_it_folds() -> None:
    limit = fold((-0.2,))
    assert limit == pytest.approx(np.sqrt(1 / 0.6))
    inside, outside = brown(np.array([[0.999 * limit, 0.0], [0.0, 1.001 * limit]]), (-0.2,))
    assert np.isfinite(inside).all()
    assert np.isnan(outside).all()


@settings(max_examples=50)
@given(st.lists(st.floats(-0.05, 0.05), min_size=9, max_size=9), st.floats(-0.4, 0.4), st.floats(-0.4, 0.4))
def test_jacobian_of_brown_is_its_derivative(c: list[float], x: float, y: float) -> None:
    terms = (tuple(c[:4]), (c[4] / 10, c[5] / 10, c[6], c[7]), (c[8] / 10, c[0] / 10, c[1] / 10, c[2] / 10))
    plane, h = np.array([[x, y]]), 1e-6
    numeric = [
        (brown(plane + h * e, *terms) - brown(plane - h * e, *terms))[0] / (2 * h) for e in (np.eye(2)[0], np.eye(2)[1])
    ]
    np.testing.assert_allclose(brown_with_jacobian(plane, *terms)[1][0], np.column_stack(numeric), atol=1e-8)


@settings(max_examples=50)
@given(st.floats(-0.3, 0.3), st.floats(-0.1, 0.1), st.floats(-0.01, 0.01), st.floats(-0.01, 0.01))
def test_inverse_brown_is_undone_by_brown(k1: float, k2: float, p1: float, p2: float) -> None:
    plane = on_plane(fan(35))
    measured = inverse_brown(plane, (k1, k2), (p1, p2))
    solved = np.isfinite(measured).all(axis=1)
    assert solved[np.hypot(*plane.T) < 0.3].all()
    np.testing.assert_allclose(brown(measured, (k1, k2), (p1, p2))[solved], plane[solved], rtol=0, atol=1e-12)


def test_inverse_brown_has_nothing_beyond_the_fold() -> None:
    reached = fold((-0.5,)) * (1 - 0.5 * fold((-0.5,)) ** 2)
    assert np.isfinite(inverse_brown(np.array([[0.99 * reached, 0.0]]), (-0.5,))).all()
    assert np.isnan(inverse_brown(np.array([[1.01 * reached, 0.0]]), (-0.5,))).all()


def test_double_sphere_by_its_formula_and_where_it_is_valid() -> None:
    xi, alpha = -0.172, 0.593
    points = fan(100)
    x, y, z = points.T
    d1 = np.sqrt(x**2 + y**2 + z**2)
    d2 = np.sqrt(x**2 + y**2 + (xi * d1 + z) ** 2)
    expected = points[:, :2] / (alpha * d2 + (1 - alpha) * (xi * d1 + z))[:, None]
    np.testing.assert_allclose(double_sphere(points, xi, alpha), expected, rtol=0, atol=1e-13)
    assert np.isnan(double_sphere(np.array([[0.01, 0, -1.0]]), xi, alpha)).all()


@pytest.mark.parametrize("xi", [0.3, 0.9, 1.0, 2.1])
def test_omni_is_eucm_and_double_sphere_in_disguise(xi: float) -> None:
    points, alpha = fan(170), xi / (1 + xi)
    expected = omni(points, xi) * (1 + xi)
    assert np.isfinite(expected).all(axis=1).mean() > 0.5
    np.testing.assert_allclose(eucm(points, alpha, 1.0), expected, atol=1e-12)
    np.testing.assert_allclose(double_sphere(points, 0.0, alpha), expected, atol=1e-12)


def test_fisheyes_by_their_angle() -> None:
    points = fan(179)
    theta = np.arccos(points[:, 2].clip(-1, 1))
    np.testing.assert_allclose(np.hypot(*equidistant(points).T), theta, atol=1e-7)
    np.testing.assert_allclose(np.hypot(*equisolid(points).T), 2 * np.sin(theta / 2), atol=1e-7)
    assert np.isnan(equidistant(np.array([[0.0, 0.0, -1.0]]))).all()


def test_ocam_by_its_formula() -> None:
    c = (378.7, 248.0, 9.76, 14.7, 22.4)
    points = fan(80)[1:]
    r = np.hypot(points[:, 0], points[:, 1])
    t = np.arctan(-points[:, 2] / np.where(r > 0, r, 1))
    rho = c[0] + c[1] * t + c[2] * t**2 + c[3] * t**3 + c[4] * t**4
    expected = points[:, :2] / np.where(r > 0, r, 1)[:, None] * rho[:, None]
    ours = ocam(points, c)
    seen = np.isfinite(ours).all(axis=1) & (r > 0)
    assert seen.mean() > 0.7
    np.testing.assert_allclose(ours[seen], expected[seen], rtol=0, atol=1e-10)


@pytest.mark.parametrize(
    "formula", [on_plane, equidistant, equisolid, lambda p: omni(p, 0.9), lambda p: eucm(p, 0.5, 1)]
)
def test_the_axis_is_the_centre_and_nothing_warns_behind_the_camera(formula) -> None:
    strange = np.array([[0, 0, 1.0], [0, 0, -1.0], [0, 0, 0], [1, 0, 0], [np.nan, 0, 1], [1e300, 1, 1e-300]])
    assert (formula(strange)[0] == 0).all()
