"""What all tests share: how examples are drawn, the real data, and a small world in photographs and a camera file."""

import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import HealthCheck, settings

if TYPE_CHECKING:
    from worlds import SmallWorld

# the same examples for everybody, however long they take; `pytest --hypothesis-profile=explore` tries others
settings.register_profile("alike", deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)
settings.register_profile("explore", parent=settings.get_profile("alike"), derandomize=False)
settings.load_profile("alike")


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """Other people's images and files, never part of this repository; without them the test skips, or fails in CI."""
    default = Path(__file__).resolve().parents[2] / "shared" / "data"
    folder = Path(os.environ.get("OPENCSP_CALIB_DATA", default))
    if not folder.is_dir():
        message = f"no real data in {folder}; set OPENCSP_CALIB_DATA"
        if os.environ.get("OPENCSP_CALIB_REQUIRE_DATA") == "1":
            pytest.fail(message)
        pytest.skip(message)
    return folder


@pytest.fixture(scope="session")
def small_world() -> "SmallWorld":
    """A camera and a board whose photographs are small enough to render many."""
    from worlds import SmallWorld

    return SmallWorld.seeded()


@pytest.fixture(scope="session")
def photographs(small_world: "SmallWorld", tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with photographs of the small world, in order."""
    folder = tmp_path_factory.mktemp("photographs")
    small_world.photograph(folder)
    return folder


@pytest.fixture(scope="session")
def camera_file(photographs: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The camera file that the command line makes of them."""
    from worlds import SmallWorld

    from opencsp_calib.cli import run

    path = tmp_path_factory.mktemp("calibrated") / "camera.h5"
    command = ["calibrate", str(photographs), "--board", SmallWorld.spec, "-o", str(path)]
    assert run([*command, "--note", "aperture=f/8", "--pixel-pitch", "4.4"]) == 0
    return path


@pytest.fixture(scope="session")
def emulated_cameras() -> Iterator[None]:
    """Basler's emulated cameras for this process alone.

    Every process emulates the same serial numbers, and a lock in the folder for temporary files says who has one.
    """
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        patch.setenv("TMPDIR", folder)  # for the processes that a test starts
        patch.setattr(tempfile, "tempdir", folder)
        yield
