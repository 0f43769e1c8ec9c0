"""VisualSFM: the radial term takes what was measured to what is undistorted."""

from pathlib import Path

import numpy as np
import pytest
from format_truth import agree, directions, opencv
from opencsp_calib_formats.nvm import Nvm

from opencsp_calib import InputError
from opencsp_calib.errors import FileFormatError, NotExactError
from opencsp_calib.importing import exact


def read(tmp_path: Path, *lines: str, header: str = "NVM_V3"):
    path = tmp_path / "model.nvm"
    path.write_text(f"{header}\n\n{len(lines)}\n" + "\n".join(lines) + "\n")
    assert Nvm().recognises(path)
    return Nvm().read(path)


def test_without_distortion_it_is_exact(tmp_path: Path) -> None:
    cameras = read(tmp_path, "a b.jpg 900.5 1 0 0 0 1 2 3 0 0", "a b.jpg 800 1 0 0 0 1 2 3 0 0")
    assert list(cameras) == ["a b.jpg", "a b.jpg (2)"]
    with pytest.raises(InputError, match="--image-size"):
        exact(cameras["a b.jpg"])
    camera = exact(cameras["a b.jpg"].resize((1000, 800)))
    agree(camera.project(directions()), opencv(directions(), (900.5, 900.5, 499.5, 399.5)))
    assert [note.code for note in cameras["a b.jpg"].notes] == ["unverified-convention"]


@pytest.mark.parametrize("r", [-0.1, 0.05])
def test_what_is_projected_is_corrected_to_where_it_came_from(tmp_path: Path, r: float) -> None:
    imported = read(tmp_path, f"a.jpg 900.5 1 0 0 0 1 2 3 {r} 0")["a.jpg"].resize((1000, 800))
    with pytest.raises(NotExactError, match=f"r = {r}"):
        exact(imported)
    points = directions(30)
    measured = (imported.project(points) - [499.5, 399.5]) / 900.5
    corrected = measured * (1 + r * (measured**2).sum(axis=1))[:, None]
    agree(corrected, points[:, :2] / points[:, 2:], 1e-12)


def test_fixed_calibration_and_rotation_matrices(tmp_path: Path) -> None:
    (imported,) = read(tmp_path, "a 1 1 0 0 0 1 2 3 0 0", header="NVM_V3 FixedK 900 501 910 402").values()
    np.testing.assert_allclose(exact(imported.resize((1000, 800))).params, [900, 910, 501, 402])
    (imported,) = read(tmp_path, "a 900 1 0 0 0 1 0 0 0 1 1 2 3 0 0", header="NVM_V3_R9T").values()
    assert exact(imported.resize((1000, 800))).params[0] == 900


@pytest.mark.parametrize(
    "line", ["a 900", "a -900 1 0 0 0 1 2 3 0 0", "a b 1 0 0 0 1 2 3 0 0", "900 1 0 0 0 1 2 3 0 0"]
)
def test_refused(tmp_path: Path, line: str) -> None:
    with pytest.raises(FileFormatError):
        read(tmp_path, line)
