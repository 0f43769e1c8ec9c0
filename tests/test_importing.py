"""Which format, which camera, exact or fitted: with formats made up here, so that no plugin decides the outcome."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from opencsp_calib import Camera, InputError, Problem
from opencsp_calib.errors import FileFormatError, MissingDependencyError, NotExactError, PluginWarning
from opencsp_calib.importing import as_imported, exact, fitted, not_exactly, pick, read_cameras, recognise
from opencsp_calib.interfaces import CameraFormat, Imported

PARAMS = np.array([500.0, 501, 320, 240, -0.1, 0.02, 1e-3, -2e-3])
CAMERA = Camera("a", "opencv4", PARAMS, (640, 480))


@dataclass
class Made:
    """Recognises files that its name is in, and reads what it is given."""

    name: str
    cameras: Mapping[str, Imported]
    lacks: str | None = None
    reads: bool = True
    title = "a format of the test"
    extensions = (".txt",)
    writes = False
    models = ()

    def missing(self) -> str | None:
        return self.lacks

    def recognises(self, path: Path) -> bool:
        return self.name in path.read_text()

    def read(self, path: Path) -> Mapping[str, Imported]:
        return self.cameras

    def write(self, cameras: Mapping[str, Camera], path: Path) -> None:
        raise InputError("is only read")


def formats(*made: Made) -> dict[str, CameraFormat]:
    assert all(isinstance(one, CameraFormat) for one in made)
    return {one.name: one for one in made}


SIZELESS = as_imported("a", "opencv4", PARAMS, None)
SIZED = as_imported("a", "opencv4", PARAMS, (640, 480))
ASKEW = not_exactly(("skew = 2 px",), lambda p: CAMERA.project(p) + 0.02 * CAMERA.project(p)[:, ::-1], (640, 480))


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "camera.txt"
    path.write_text("one two")
    return path


def test_recognised_by_content(file: Path) -> None:
    known = formats(Made("one", {}), Made("three", {}), Made("two", {}, reads=False))
    assert recognise(file, known).name == "one"
    assert recognise(file, known, "three").name == "three"  # as the user says


def test_not_recognised(file: Path, tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match=r"camera.txt may be one or two; say which with --from"):
        recognise(file, formats(Made("one", {}), Made("two", {})))
    with pytest.raises(FileFormatError, match=r"no camera file of a format we know"):
        recognise(file, formats(Made("three", {})))
    with pytest.raises(InputError, match="no readable format is called 'two'; there are one"):
        recognise(file, formats(Made("one", {}), Made("two", {}, reads=False)), "two")
    with pytest.raises(InputError, match="does not exist"):
        recognise(tmp_path / "none", {})
    with pytest.raises(InputError, match="is a folder"):
        recognise(tmp_path, {})
    with pytest.raises(MissingDependencyError, match="install that"):
        recognise(file, formats(Made("one", {}, lacks="install that")))


def test_a_strangers_format_that_raises_does_not_stop_others(file: Path) -> None:
    class Broken(Made):
        def recognises(self, path: Path) -> bool:
            raise ZeroDivisionError

    with pytest.warns(PluginWarning, match="'bad' cannot tell"):
        assert recognise(file, formats(Broken("bad", {}), Made("one", {}))).name == "one"


def test_read_with_and_without_size(file: Path) -> None:
    known = formats(Made("one", {"left": SIZELESS, "right": SIZED}))
    cameras = read_cameras(file, known, (640, 480))
    assert exact(cameras["left"]) == exact(cameras["right"]) == CAMERA
    with pytest.raises(InputError, match="add --image-size WIDTHxHEIGHT"):
        exact(read_cameras(file, known)["left"])
    with pytest.raises(InputError, match="camera 'right': its images have 640x480 pixels, not 800x600"):
        read_cameras(file, known, (800, 600))
    with pytest.raises(FileFormatError, match="holds no camera"):
        read_cameras(file, formats(Made("one", {})))


def test_pick() -> None:
    cameras = {"left": SIZED, "right": SIZELESS}
    assert pick({"only": SIZED}) == ("only", SIZED)
    assert pick(cameras, "right") == ("right", SIZELESS)
    with pytest.raises(InputError, match=r"has 2 cameras; choose one with --camera: left, right$"):
        pick(cameras)
    with pytest.raises(InputError, match="no camera is called 'middle' in the file; it has left, right"):
        pick(cameras, "middle")
    with pytest.raises(InputError, match=r"100 cameras.* 19 \.\.\. \(100 in all\)$"):
        pick({str(i): SIZED for i in range(100)})
    noted = as_imported("a", "opencv4", PARAMS, (9, 9), (Problem("ambiguous-model", "of two models"),))
    with pytest.raises(InputError, match=r"opencv4, other; of two models$"):
        pick({"opencv4": noted, "other": noted})


def test_exact_names_what_is_in_the_way_and_what_to_do() -> None:
    with pytest.raises(NotExactError, match=r"skew = 2 px; --fit MODEL .*\(pinhole, opencv4"):
        exact(ASKEW)
    with pytest.raises(NotExactError, match="a spline; and it cannot be fitted"):
        exact(not_exactly(("a spline",), None, (640, 480)))


def test_fitted_within_what_is_accepted() -> None:
    assert fitted(SIZED, "opencv5", name="b").camera.name == "b"
    with pytest.raises(NotExactError, match=r"opencv4 does not fit: rms .* px, worst .* px .*--accept-error \d"):
        fitted(ASKEW, "opencv4")
    found = fitted(ASKEW, "opencv4", 20.0)
    assert 0.1 < found.worst_px < 20.0
    with pytest.raises(NotExactError, match="cannot be fitted: a spline"):
        fitted(not_exactly(("a spline",), None, (640, 480)), "opencv4")
    with pytest.raises(InputError, match="--image-size"):
        fitted(SIZELESS, "opencv4")


def test_what_is_suggested_to_accept_is_accepted() -> None:
    with pytest.raises(NotExactError) as refused:
        fitted(ASKEW, "opencv4")
    suggested = float(str(refused.value).rpartition(" ")[2])
    assert fitted(ASKEW, "opencv4", suggested).worst_px <= suggested


def test_a_size_makes_the_rest() -> None:
    assert SIZELESS.resize is not None
    assert exact(SIZELESS.resize((640, 480))) == CAMERA
    waiting = not_exactly(("skew",), CAMERA.project, None)
    assert waiting.resize is not None
    assert waiting.resize((640, 480)).image_size == (640, 480)
    with pytest.raises(InputError, match="positive"):
        as_imported("a", "opencv4", -PARAMS, None)  # said at once, not when the size is known
