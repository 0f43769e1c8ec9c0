"""Ames Stereo Pipeline: OpenCV's formulas in units of the pitch."""

from pathlib import Path

import numpy as np
import pytest
from format_files_robotics import TSAI
from format_truth import agree, directions, opencv, opencv_fisheye, perspective
from opencsp_calib_formats.tsai import Tsai

from opencsp_calib import InputError
from opencsp_calib.errors import FileFormatError, NotExactError
from opencsp_calib.importing import exact

SIZE, K = (1000, 800), (900.5, 901.5, 502.0, 398.5)
BODY = TSAI.decode().split("TSAI")[0]


def read(tmp_path: Path, text: str):
    path = tmp_path / "camera.tsai"
    path.write_text(text)
    assert Tsai().recognises(path)
    return Tsai().read(path)["camera"]


def test_real_file_in_the_short_layout(data_dir: Path) -> None:
    (imported,) = Tsai().read(data_dir / "formats" / "misc_tsai" / "black_left.tsai").values()
    with pytest.raises(InputError, match="--image-size"):
        exact(imported)
    camera = exact(imported.resize((1024, 768)))
    expected = [620.857971191406, 622.298034667969, 526.128784179688, 374.273742675781]
    expected += [-0.331998556852341, 0.125557452440262, -0.000432605884270742, 0.00110327918082476]
    np.testing.assert_array_equal(camera.params, expected)
    assert [note.code for note in imported.notes] == ["unverified-convention"] * 2


def test_tsai(tmp_path: Path) -> None:
    camera = exact(read(tmp_path, TSAI.decode()).resize(SIZE))
    agree(camera.project(directions()), opencv(directions(), K, (-0.1, 0.02, 1e-3, -2e-3, -3e-3)))


def test_fisheye_and_null(tmp_path: Path) -> None:
    fisheye = exact(read(tmp_path, BODY + "FISHEYE\nk1 = 0.01\nk2 = -0.02\nk3 = 0.001\nk4 = -0.0002\n").resize(SIZE))
    agree(fisheye.project(directions(80)), opencv_fisheye(directions(80), K, (0.01, -0.02, 1e-3, -2e-4)))
    assert exact(read(tmp_path, BODY + "NULL\n").resize(SIZE)).model == "pinhole"


def test_field_of_view(tmp_path: Path) -> None:
    imported = read(tmp_path, BODY + "FOV\nk1 = 0.93\n")
    with pytest.raises(NotExactError, match=r"k1 = 0\.93"):
        exact(imported)
    x, y = perspective(directions(60))
    away = np.hypot(x, y) > 0
    r = np.hypot(x, y)[away]
    scale = np.arctan(r * 2 * np.tan(0.93 / 2)) / 0.93 / r
    expected = np.column_stack([K[0] * x[away] * scale + K[2], K[1] * y[away] * scale + K[3]])
    agree(imported.project(directions(60))[away], expected)


@pytest.mark.parametrize("kind", ["BrownConrady", "Photometrix", "AdjustableTSAI", "RPC"])
def test_other_distortions_are_refused_by_name(tmp_path: Path, kind: str) -> None:
    with pytest.raises(NotExactError, match=kind):
        exact(read(tmp_path, BODY + kind + "\nk1 = 0.1\n"))


def test_turned_axes_are_refused(tmp_path: Path) -> None:
    with pytest.raises(NotExactError, match="v_direction"):
        exact(read(tmp_path, TSAI.decode().replace("v_direction = 0  1  0", "v_direction = 0 -1 0")))


@pytest.mark.parametrize(
    "text",
    [
        TSAI.decode().replace("pitch = 0.01", "pitch = 0"),
        TSAI.decode().replace("fu = 9.005", "fu = -9.005"),
        TSAI.decode().replace("k1 = -0.1\n", ""),
        TSAI.decode() + "k1 = 0.3\n",
        TSAI.decode() + "FISHEYE\n",
        BODY + "FOV\nk1 = 4\n",
    ],
)
def test_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(FileFormatError):
        read(tmp_path, text)
