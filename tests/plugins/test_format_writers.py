"""Every format that reads and writes: what it wrote it reads again, to the last bits."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from opencsp_calib import Camera, InputError
from opencsp_calib.camera_files import write_camera_file
from opencsp_calib.importing import exact
from opencsp_calib.models import LENS_MODELS
from opencsp_calib.registry import installed

WRITERS = [(f.name, model) for f in installed().camera_formats.values() if f.reads and f.writes for model in f.models]
SIDES = st.integers(1, 10_000)


@pytest.mark.parametrize(("name", "model"), WRITERS)
@settings(max_examples=8)
@given(
    f=st.floats(100, 1e5),
    aspect=st.floats(0.9, 1.1),
    centre=st.tuples(st.floats(-100, 5000), st.floats(-100, 5000)),
    d=st.lists(st.floats(-0.5, 0.5), min_size=14, max_size=14),
    size=st.tuples(SIDES, SIDES),
)
def test_written_and_read_again(tmp_path: Path, name: str, model: str, f, aspect, centre, d, size) -> None:
    coefficients = d[: len(LENS_MODELS[model].distortion_names)]
    camera = Camera("x", model, np.array([f, f * aspect, *centre, *coefficients]), size)
    format_ = installed().camera_formats[name]
    path = tmp_path / f"camera{format_.extensions[0]}"
    format_.write({"x": camera}, path)
    (imported,) = format_.read(path).values()
    again = exact(imported if imported.image_size else imported.resize(size))
    assert again.image_size == size
    read = np.concatenate([again.params, np.zeros(14)])  # zeros may be left out or added
    written = np.concatenate([camera.params, np.zeros(len(read) - len(camera.params))])
    scale = np.ones(len(read))
    scale[:4] = [*camera.params[:2], *np.maximum(np.abs(centre), size)]
    assert (np.abs(read - written) <= 1e-12 * scale).all()


@pytest.mark.parametrize("name", sorted({name for name, _ in WRITERS}))
def test_any_name_and_notes_can_be_read_again(name: str, tmp_path: Path) -> None:
    """Names come from folders and other programs' files."""
    format_ = installed().camera_formats[name]
    for called in ('"quoted"', 'a "b"', "it's", "a\nb", "\x01\x7f\x9f", "\ud800", "<&>--]]>", "# a: b", "%YAML", "1 5"):
        camera = Camera(called, "opencv4", np.array([500.0, 501, 320, 240, -0.1, 0.2, 1e-4, -1e-4]), (640, 480))
        for extension in format_.extensions:
            path = tmp_path / f"camera{extension}"
            if name == "ros-ini":
                with pytest.raises(InputError, match="rename the camera"):
                    write_camera_file(camera, path, name)
                continue
            write_camera_file(camera, path, name, {"lens": called, called: "x"})
            cameras = format_.read(path).values()
            assert camera.params.tolist() in [exact(one).params[:8].tolist() for one in cameras if one.image_size]
            if name == "opencv" and called.isprintable():
                assert {exact(one).name for one in cameras} == {called}


@pytest.mark.parametrize("name", ["metashape", "opensfm", "transforms_json"])
def test_no_more_than_rounding_is_lost_on_the_way_to_other_units(name: str, tmp_path: Path) -> None:
    camera = Camera("x", "opencv4", np.array([2709.98, 2704.13, 853.7, 628.0, -0.1, 0.2, 1e-4, -1e-4]), (1626, 1236))
    format_, path = installed().camera_formats[name], tmp_path / "camera"
    format_.write({"x": camera}, path)
    (imported,) = format_.read(path).values()
    np.testing.assert_allclose(exact(imported).params, camera.params, rtol=4e-16, atol=5e-13)
