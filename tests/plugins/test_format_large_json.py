"""Reconstructions larger than we read: their cameras are found at the beginning, and it is said."""

import json
from pathlib import Path

import pytest
from effort import at_most
from opencsp_calib_formats.alicevision import AliceVision
from opencsp_calib_formats.openmvg import OpenMvg
from opencsp_calib_formats.opensfm import OpenSfM
from opencsp_calib_formats.safe_text import MAX_BYTES

from opencsp_calib.errors import FileFormatError
from opencsp_calib.importing import exact

OPENSFM = {"projection_type": "perspective", "width": 1000, "height": 800, "focal": 0.9, "k1": 0.1, "k2": 0.0}
MESHROOM = {"intrinsicId": "a", "width": "1000", "height": "800", "type": "pinhole", "focalLength": "4.5"}
MESHROOM |= {"sensorWidth": "5", "principalPoint": ["0", "0"], "distortionType": "none"}
OPENMVG = {"width": 1000, "height": 800, "focal_length": 900.0, "principal_point": [499.5, 399.5]}
OPENMVG = {"polymorphic_name": "pinhole", "polymorphic_id": 1, "ptr_wrapper": {"data": OPENMVG}}
CASES = [
    (OpenSfM(), '[{"cameras": %s, "points": {%s}}]', {"a": OPENSFM}),
    (AliceVision(), '{"version": ["1", "2", "11"], "intrinsics": %s, "structure": {%s}}', [MESHROOM]),
    (OpenMvg(), '{"sfm_data_version": "0.3", "intrinsics": %s, "x": {%s}}', [{"key": "a", "value": OPENMVG}]),
]


@pytest.mark.parametrize(("format_", "layout", "cameras"), CASES)
def test_cameras_come_first(format_, layout: str, cameras: object, tmp_path: Path) -> None:
    path = tmp_path / "large.json"
    points = ",".join(f'"{i}": [1.5, 2.5, 3.5]' for i in range(100_000))
    path.write_text(layout % (json.dumps(cameras), points + " " * MAX_BYTES))
    with at_most(10):
        assert format_.recognises(path)
        (imported,) = format_.read(path).values()
    assert exact(imported).params[0] == pytest.approx(900)
    assert "read-in-part" in [note.code for note in imported.notes]


@pytest.mark.parametrize(("format_", "layout", "cameras"), CASES)
def test_cameras_that_are_cut_are_none(format_, layout: str, cameras: object, tmp_path: Path) -> None:
    path = tmp_path / "large.json"
    path.write_text(layout % (json.dumps(cameras)[:-1] + " " * MAX_BYTES, '"a": 1'))
    with pytest.raises(FileFormatError):
        format_.read(path)
