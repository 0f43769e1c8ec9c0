"""What all tests share: where the real data is."""

import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import HealthCheck, settings

if TYPE_CHECKING:
    from worlds import SmallWorld

# on a busy machine, how long an example takes says nothing about it
settings.register_profile("any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any machine")


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
def emulated_cameras() -> Iterator[None]:
    """Basler's emulated cameras for this process alone.

    Every process emulates the same serial numbers, and a lock in the folder for temporary files says who has one.
    """
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        patch.setenv("TMPDIR", folder)  # for the processes that a test starts
        patch.setattr(tempfile, "tempdir", folder)
        yield
