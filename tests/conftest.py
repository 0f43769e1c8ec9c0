"""What all tests share: where the real data is."""

import os
from pathlib import Path

import pytest


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
