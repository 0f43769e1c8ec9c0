"""The seed's procedure from the first button to the last, on its own photographs, in a browser."""

from pathlib import Path

import pytest
from gui_window import Window

pytestmark = pytest.mark.timeout(600)


def test_the_whole_procedure(window: Window, data_dir: Path, tmp_path: Path) -> None:
    photographs = sorted((data_dir / "sandia_checkerboard").glob("*.png"))
    window.picture("1-start")
    assert not any(map(str.isdigit, window.rms))
    for step in (
        "find-corners",
        "view-corners",
        "calibrate",
        "reprojection-error",
        "visualize-distortion",
        "save-camera",
    ):
        assert not window.enabled(step), step
    window.describe("sandia", 18, 23, 50)
    assert not window.enabled("find-corners")
    window.select(photographs)
    window.until(lambda: window.enabled("find-corners"))
    window.picture("2-selected")
    window.find_corners()
    window.picture("3-found")
    window.calibrate()
    window.picture("4-calibrated")
    window.click("save-camera")
    window.until(lambda: window.status.startswith("Camera saved"))
    window.picture("5-saved")
