"""Files that are damaged, hostile or not what they seem: only our own errors come out, in bounded time."""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
import pytest
from effort import at_most
from format_files import FILES
from hypothesis import given, settings
from hypothesis import strategies as st

from opencsp_calib.errors import CalibError
from opencsp_calib.importing import exact
from opencsp_calib.interfaces import CameraFormat, Imported
from opencsp_calib.registry import installed

CASES = [(name, file) for name, files in FILES.items() for file in files]
READERS = sorted(name for name, format_ in installed().camera_formats.items() if format_.reads)
NUMBERS = [b"nan", b"-inf", b"-1", b"0", b"1e308", b"-1e99", b"1e-308", b"9" * 400, b"1_0", b"", b"null", b"[]"]
STRANGE = [*NUMBERS, b"{}", b'""', b"true", b"\xff\xfe", b"\x00", b"\xc3\x28", b"\xe2\x80\xae", b"1;2", b"&x;", b"0x10"]
OPENINGS = [b"[", b'{"a":', b"<a>", b"- ", b"a:\n ", b"a = ", b"[[a.", b"&a [*a,", b'{"cameras":[']
RAYS = np.array(
    [[0.0, 0.0, 1.0], [0.1, -0.2, 1.0], [0.5, 0.4, 1.0], [1.0, 0.0, 0.0], [0.0, 0.1, -1.0], [0.0, 0.0, -1.0]]
)
FEW = settings(max_examples=30)


def format_of(name: str) -> CameraFormat:
    return installed().camera_formats[name]


def use(imported: Imported) -> None:
    """What everybody does with an import."""
    if imported.resize is not None and imported.image_size is None:
        use(imported.resize((1000, 800)))
    if imported.project is not None:
        assert imported.project(RAYS).shape == (len(RAYS), 2)
    if not imported.obstacles and imported.image_size is not None:
        camera = exact(imported)
        assert camera.image_size == imported.image_size
        assert np.isfinite(camera.params).all()
        camera.project(RAYS)


def try_to_read(format_: CameraFormat, path: Path, data: bytes) -> None:
    """Read and use what a file holds; our own errors are fine, others are not."""
    path.write_bytes(data)
    assert format_.recognises(path) in (True, False)
    message = ""
    try:
        cameras: Mapping[str, Imported] = format_.read(path)
        for imported in list(cameras.values())[:5]:
            use(imported)
    except CalibError as error:
        message = str(error)
    assert "\n" not in message
    assert len(message) < 600 + len(str(path))


def numbers(data: bytes) -> Iterator[tuple[int, int]]:
    """Where the numbers of a file are."""
    return (match.span() for match in re.finditer(rb"(?<![\w.])-?\d+\.?\d*(?:e[+-]?\d+)?", data))


@pytest.mark.parametrize(("name", "file"), CASES)
def test_the_file_itself_is_recognised_by_its_format_alone_and_read(name: str, file: str, tmp_path: Path) -> None:
    path = tmp_path / file
    path.write_bytes(FILES[name][file])
    formats = installed().camera_formats
    assert [key for key in formats if formats[key].reads and formats[key].recognises(path)] == [name]
    cameras = format_of(name).read(path)
    assert cameras
    for imported in cameras.values():
        use(imported)


@pytest.mark.parametrize(("name", "file"), CASES)
def test_truncated_at_every_byte(name: str, file: str, tmp_path: Path) -> None:
    data, format_ = FILES[name][file], format_of(name)
    for length in range(len(data)):
        try_to_read(format_, tmp_path / file, data[:length])


@pytest.mark.parametrize(("name", "file"), CASES)
def test_strange_things_in_the_place_of_each_number(name: str, file: str, tmp_path: Path) -> None:
    data, format_ = FILES[name][file], format_of(name)
    for start, end in numbers(data):
        for strange in NUMBERS:
            try_to_read(format_, tmp_path / file, data[:start] + strange + data[end:])


@pytest.mark.parametrize(("name", "file"), CASES)
@FEW
@given(seed=st.integers(0, 2**32), changes=st.integers(1, 6))
def test_pieces_deleted_doubled_moved_and_replaced(
    name: str, file: str, tmp_path: Path, seed: int, changes: int
) -> None:
    chance, data = np.random.default_rng(seed), bytearray(FILES[name][file])
    for _ in range(changes):
        start = int(chance.integers(len(data) + 1))
        piece = bytes(data[start : start + int(chance.choice([1, 1, 2, 8, 40]))])
        strange, byte = STRANGE[chance.integers(len(STRANGE))], bytes([chance.integers(256)])
        data[start : start + len(piece)] = [b"", piece * 2, strange, byte, piece[::-1]][chance.integers(5)]
    try_to_read(format_of(name), tmp_path / file, bytes(data))


@pytest.mark.parametrize("name", READERS)
@FEW
@given(data=st.binary(max_size=200))
def test_random_bytes(name: str, tmp_path: Path, data: bytes) -> None:
    try_to_read(format_of(name), tmp_path / "file", data)


@pytest.mark.parametrize("name", READERS)
def test_deeply_nested(name: str, tmp_path: Path) -> None:
    for opening in OPENINGS:
        with at_most(5):
            try_to_read(format_of(name), tmp_path / "file", opening * 50_000)


@pytest.mark.parametrize("name", READERS)
def test_no_file_no_text_and_a_folder(name: str, tmp_path: Path) -> None:
    format_ = format_of(name)
    for path in (tmp_path / "none", tmp_path):
        assert not format_.recognises(path)
        with pytest.raises(CalibError):
            format_.read(path)


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("bundler", b"# Bundle file v0.3\n1152921504606846976 5\n9e2 0 0\n"),
        ("bundler", b"# Bundle file v0.3\n60000 0\n" + b"9e2 0 0 1 0 0 0 1 0 0 0 1 0 0 0\n" * 25_000),
        ("nvm", b"NVM_V3\n\n1152921504606846976\na 9e2 1 0 0 0 0 0 0 0 0\n"),
        ("nvm", b"NVM_V3\n\n60000\n" + b"a 9e2 1 0 0 0 0 0 0 0 0\n" * 25_000),
        ("opensfm", b"[" + b'{"cameras":{"a":{"projection_type":"dual","width":9,"height":9}}},' * 25_000 + b"{}]"),
        ("transforms_json", b'{"frames": [' + b",".join(b'{"fl_x": %d}' % i for i in range(1, 25_000)) + b"]}"),
    ],
)
def test_claims_and_heaps_of_cameras_cost_little(name: str, data: bytes, tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(data)
    with at_most(10), pytest.raises(CalibError):
        format_of(name).read(path)


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("cahvor", b"\n" * 60_000),
        ("kalibr", b"\n" * 60_000),
        ("bouguet", b"." * 60_000),
        ("halcon", b"ParGroup: Cam;\nFocus:" + b" " * 60_000),
        ("mrcal", b"#" * 60 + b"\n'lensmodel': 'LENSMODEL_PINHOLE', 'intrinsics': "),
        ("tsai", b"fv = 1\ncu = 1\ncv = 1\nfu = " + b"0" * 60_000 + b" 1\n"),
    ],
)
def test_long_runs_of_one_character_cost_little(name: str, data: bytes, tmp_path: Path) -> None:
    """Where a pattern could try each of their parts again from each of their characters."""
    with at_most(2):
        try_to_read(format_of(name), tmp_path / "file", data)
