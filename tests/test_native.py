"""The compiled part: that it is found, takes nothing it cannot read, and says the same on every processor."""

import _ctypes
import ctypes
import shutil
from pathlib import Path

import numpy as np
import pytest

from opencsp_calib import native
from opencsp_calib.corner_kernel import fit_corners
from opencsp_calib.errors import MissingDependencyError

VARIANTS = sorted(Path(native.__file__).parent.glob(f"_native*{native.SUFFIX}"))


def test_an_installation_without_it_says_what_to_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(native, "__file__", str(tmp_path / "native.py"))
    with pytest.raises(MissingDependencyError, match="install opencsp-calib again"):
        native._library.__wrapped__()
    (tmp_path / f"_native{native.SUFFIX}").write_bytes(b"no library")
    with pytest.raises(MissingDependencyError, match="cannot be loaded"):
        native._library.__wrapped__()


def test_one_that_is_older_than_its_sources_is_not_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "build_hook.py").touch()
    (tmp_path / "changed.c").write_text("int changed;\n", encoding="utf-8")
    monkeypatch.setattr(native, "SOURCES", tmp_path)
    with pytest.raises(MissingDependencyError, match="older than its sources: install opencsp-calib again"):
        native._library.__wrapped__()


def test_nor_is_one_that_is_too_old_to_say_of_what_it_was_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copy(_ctypes.__file__, tmp_path / f"_native{native.SUFFIX}")  # any library
    (tmp_path / "build_hook.py").touch()
    monkeypatch.setattr(native, "__file__", str(tmp_path / "native.py"))
    monkeypatch.setattr(native, "SOURCES", tmp_path)
    with pytest.raises(MissingDependencyError, match="older than its sources"):
        native._library.__wrapped__()


def test_an_array_of_another_kind_is_refused() -> None:
    image = np.zeros((20, 20), np.uint16)
    numbers = np.zeros((1, 11)), np.zeros((1, 2)), np.full((1, 4), 3.0)
    for wrong in (image.astype(np.float64), image[:, ::2], image.T[1:].T):
        with pytest.raises(ctypes.ArgumentError):
            fit_corners(wrong, 255, *numbers, 0.01, 5, examine=True)


def corner(x: float, y: float) -> np.ndarray:
    """An image of 40x40 pixels whose corner is at (x, y), blurred by some 1 px."""
    rows, columns = np.mgrid[:40, :40]
    return np.rint(100 + 80 * np.tanh(columns - x) * np.tanh(rows - y)).astype(np.uint16)


def fitted(image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    parameters = np.array([[20.0, 20.0, 0.02, np.pi / 2, 1.5, 100.0, 50.0, 0, 0, 0, 0]])
    window = np.array([[9.0, 9.0, np.inf, np.inf]])
    return parameters, fit_corners(image, 255, parameters, np.zeros((1, 2)), window, 1e-3, 20, examine=True)


def test_eight_and_sixteen_bits_are_read_alike() -> None:
    image = corner(20.3, 19.6)
    for one, other in zip(fitted(image), fitted(image.astype(np.uint8)), strict=True):
        assert np.array_equal(one, other)


@pytest.mark.skipif(len(VARIANTS) < 2, reason="there is one form for all processors of this kind")
def test_every_processor_gets_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    from opencsp_calib import corner_kernel

    results = []
    for file in VARIANTS:
        library = ctypes.CDLL(str(file))
        monkeypatch.setattr(native, "_library", lambda library=library: library)
        corner_kernel._compiled.cache_clear()
        results.append(fitted(corner(20.3, 19.6)))
    corner_kernel._compiled.cache_clear()
    (parameters, found), (others, found_by_others) = results
    assert np.abs(parameters - others)[0, :2].max() < 1e-5
    assert np.allclose(found, found_by_others, rtol=1e-3, atol=1e-4)
    assert parameters[0, :2] == pytest.approx((20.3, 19.6), abs=0.005)
    assert found[0, 0] == 0


def test_a_window_outside_of_the_image_is_not_read() -> None:
    places = [(1, 20), (20, 39), (np.nan, 20), (1e300, 20)]
    parameters = np.array([[x, y, 0.0, np.pi / 2, 1.5, 100.0, 50.0, 0, 0, 0, 0] for x, y in places])
    windows = np.tile([9.0, 9.0, np.inf, np.inf], (len(places), 1))
    found = fit_corners(corner(20, 20), 255, parameters, np.zeros((len(places), 2)), windows, 1e-3, 20, examine=True)
    assert (found[:, 0] == 1).all()


def test_a_window_larger_than_there_is_room_for_is_refused() -> None:
    image = np.zeros((400, 400), np.uint16)
    parameters = np.array([[200.0, 200.0, 0.0, np.pi / 2, 1.5, 100.0, 50.0, 0, 0, 0, 0]])
    found = fit_corners(image, 255, parameters, np.zeros((1, 2)), np.full((1, 4), 100.0), 1e-3, 20, examine=True)
    assert found[0, 0] == 1
