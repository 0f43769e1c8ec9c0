"""To and from OpenCSP: its own class where it is installed, else one written from its description."""

import runpy
import sys
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np
import opencsp_as_described
import pytest
from camera_files import camera_of

from opencsp_calib import Camera, InputError
from opencsp_calib.errors import MissingDependencyError, NotExactError
from opencsp_calib.models import LENS_MODELS
from opencsp_calib.synthetic import demo_camera

EXAMPLE = Path(__file__).resolve().parents[1] / "docs" / "scripts" / "opencsp_example.py"
LIBRARY = "opencsp.common.lib"
PACKAGES = ("opencsp", "opencsp.common", LIBRARY, f"{LIBRARY}.camera", f"{LIBRARY}.geometry")
MODULES = (f"{LIBRARY}.camera.Camera", f"{LIBRARY}.geometry.Vxy")


@pytest.fixture
def opencsp(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """OpenCSP, or what stands in for it, importable under its own names."""
    try:
        return import_module(MODULES[0])
    except ImportError:
        for name in PACKAGES:
            monkeypatch.setitem(sys.modules, name, ModuleType(name))
        for name in MODULES:
            monkeypatch.setitem(sys.modules, name, opencsp_as_described)
        return opencsp_as_described


@pytest.mark.parametrize("model", [model for model in LENS_MODELS if model != "opencv_fisheye"])
def test_there_and_back(opencsp: ModuleType, model: str) -> None:
    theirs = camera_of(model).to_opencsp()
    assert isinstance(theirs, opencsp.Camera)
    again = Camera.from_opencsp(theirs)
    if model == "pinhole":  # which theirs has with four coefficients of zero
        assert again == replace(camera_of(model), model="opencv4", params=[*camera_of(model).params, 0, 0, 0, 0])
    else:
        assert again == camera_of(model)


def test_a_file_of_ours_is_their_camera(opencsp: ModuleType, tmp_path: Path) -> None:
    demo_camera().save(tmp_path / "camera.h5")
    assert Camera.from_opencsp(opencsp.Camera.load_from_hdf(str(tmp_path / "camera.h5"))) == demo_camera()


def test_rays_are_those_that_sofast_takes(opencsp: ModuleType) -> None:
    camera = demo_camera()
    pixels = np.array([[0.0, 0.0], [812.5, 617.5], [1625.0, 0.0], [1625.0, 1235.0]])
    points = import_module(MODULES[1]).Vxy(pixels.T)
    theirs = camera.to_opencsp().vector_from_pixel(points).data.T
    # their five iterations leave 1e-7 of a radian with this lens
    np.testing.assert_allclose(camera.unproject(pixels), theirs, rtol=0, atol=1e-6)


def test_a_fisheye_cannot_be_one(opencsp: ModuleType) -> None:
    with pytest.raises(NotExactError, match="no fisheye"):
        camera_of("opencv_fisheye").to_opencsp()


def test_what_is_no_camera_of_ours_is_refused(opencsp: ModuleType) -> None:
    theirs = demo_camera().to_opencsp()
    theirs.distortion_coef = np.zeros(7)
    with pytest.raises(InputError, match="7 distortion coefficients"):
        Camera.from_opencsp(theirs)
    skewed = demo_camera().to_opencsp()
    skewed.intrinsic_mat = skewed.intrinsic_mat + np.array([[0, 1.5, 0], [0, 0, 0], [0, 0, 0]])
    with pytest.raises(InputError, match="skew"):
        Camera.from_opencsp(skewed)


def test_without_opencsp_it_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "opencsp", None)
    with pytest.raises(MissingDependencyError, match="OpenCSP cannot be imported"):
        demo_camera().to_opencsp()


def test_the_worked_example(
    opencsp: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    old, new = str(tmp_path / "old.h5"), str(tmp_path / "new.h5")
    camera = demo_camera()
    camera.save(new)
    Camera("old", "opencv4", camera.params + np.eye(8)[4] * 0.01, camera.image_size).save(old)
    monkeypatch.setattr(sys, "argv", ["opencsp_example.py", old, new])
    runpy.run_path(str(EXAMPLE), run_name="__main__")
    printed = dict(line.split(": ") for line in capsys.readouterr().out.splitlines())
    assert float(printed["middle"].split()[0]) < 0.05
    # at the corner r = 0.386, where k1 0.01 greater moves a ray by up to 0.01 r^3 = 0.57 mrad
    assert 0.2 < float(printed["upper left"].split()[0]) < 0.6
