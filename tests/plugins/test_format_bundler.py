"""Bundler against its README: y up, looking along -z, origin in the image's centre."""

from pathlib import Path

import numpy as np
import pytest
from format_truth import agree, directions
from opencsp_calib_formats.bundler import Bundler

from opencsp_calib import InputError
from opencsp_calib.errors import FileFormatError
from opencsp_calib.importing import exact


def test_real_file_projects_as_the_readme_says(data_dir: Path) -> None:
    cameras = Bundler().read(data_dir / "formats" / "bundler" / "kermit_bundle.out")
    text = (data_dir / "formats" / "bundler" / "kermit_bundle.out").read_text().split("\n")
    registered = [str(i) for i in range(11) if text[2 + 5 * i] != "0 0 0"]
    assert list(cameras) == registered
    f, k1, k2 = 688.36191949, -0.043298174566, 0.064595780129
    camera = exact(cameras["0"].resize((640, 480)))
    assert camera.image_size == (640, 480)
    points = directions()
    bundlers = points * [1, -1, -1]  # y up, z backwards
    p = -bundlers[:, :2] / bundlers[:, 2:]
    r = np.hypot(*p.T)
    from_centre = f * (1 + k1 * r**2 + k2 * r**4)[:, None] * p  # x right, y up
    agree(camera.project(points), from_centre * [1, -1] + [319.5, 239.5])


def test_the_image_size_is_asked_for_and_the_centre_is_flagged(data_dir: Path) -> None:
    cameras = Bundler().read(data_dir / "formats" / "bundler" / "kermit_bundle.out")
    with pytest.raises(InputError, match="--image-size"):
        exact(cameras["0"])
    assert [note.code for note in cameras["0"].notes] == ["unverified-convention"]


CAMERA = "900 -0.1 0.02\n" + "1 0 0\n" * 4


@pytest.mark.parametrize(
    "text",
    [
        "# Bundle file v0.3\n2 0\n" + CAMERA,
        "# Bundle file v0.3\n0 0\n" + CAMERA,
        "# Bundle file v0.3\n-1 0\n" + CAMERA,
        "# Bundle file v0.3\n1e300 0\n" + CAMERA,
        "# Bundle file v0.3\n1 0\n" + CAMERA.replace("900", "-900"),
        "# Bundle file v0.3\n1 0\n" + "0 0 0\n" * 5,
        "# Bundle file v0.3\n",
        "something else\n1 0\n" + CAMERA,
    ],
)
def test_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "bundle.out"
    path.write_text(text)
    with pytest.raises(FileFormatError):
        Bundler().read(path)
