"""Image files: which are taken, in which order, and that their pixels are the sensor's."""

import struct
from pathlib import Path

import cv2
import numpy as np
import pytest

from opencsp_calib import InputError
from opencsp_calib.images import ImageFile, find_images, read_image, write_image

RAMP = np.arange(60 * 80, dtype=np.uint16).reshape(60, 80)


def read(path: Path) -> np.ndarray:
    return read_image(ImageFile(path.name, path)).pixels


@pytest.mark.parametrize("suffix", [".png", ".tif", ".bmp", ".pgm"])
def test_grey_levels_come_back_exactly(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"ü {suffix}{suffix}"
    cv2.imencode(suffix, (RAMP % 256).astype(np.uint8))[1].tofile(path)
    np.testing.assert_array_equal(read(path), RAMP % 256)


@pytest.mark.parametrize("suffix", [".png", ".tif", ".pgm"])
def test_sixteen_bits_stay_sixteen(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"deep{suffix}"
    cv2.imwrite(str(path), RAMP * 13)
    np.testing.assert_array_equal(read(path), RAMP * 13)


def test_colour_becomes_grey(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "c.png"), np.full((10, 12, 3), (0, 0, 255), np.uint8))
    assert read(tmp_path / "c.png").shape == (10, 12)
    assert abs(int(read(tmp_path / "c.png")[0, 0]) - 76) <= 1  # ITU-R BT.601: 0.299 red


def test_an_orientation_in_the_file_does_not_swap_width_and_height(tmp_path: Path) -> None:
    plain = cv2.imencode(".jpg", np.zeros((40, 90), np.uint8))[1].tobytes()
    entry = struct.pack("<HHIHH", 0x0112, 3, 1, 6, 0)  # orientation 6: turn by 90 degrees
    tiff = b"II*\0" + struct.pack("<I", 8) + struct.pack("<H", 1) + entry + struct.pack("<I", 0)
    exif = b"Exif\0\0" + tiff
    path = tmp_path / "turned.jpg"
    path.write_bytes(plain[:2] + b"\xff\xe1" + struct.pack(">H", len(exif) + 2) + exif + plain[2:])
    assert cv2.imread(str(path)).shape[:2] == (90, 40), "the test's own file must make OpenCV turn it"
    assert read(path).shape == (40, 90)


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".tif", ".bmp", ".pgm"])
def test_a_cut_file_is_not_half_an_image(suffix: str, tmp_path: Path) -> None:
    data = cv2.imencode(suffix, np.random.default_rng(0).integers(0, 255, (200, 300)).astype(np.uint8))[1].tobytes()
    for share in (0.02, 0.5, 0.97):
        path = tmp_path / f"cut{suffix}"
        path.write_bytes(data[: int(len(data) * share)])
        with pytest.raises(InputError, match=f"cut{suffix}"):
            read(path)


@pytest.mark.parametrize("content", [b"", b"not an image", b"\x89PNG\r\n\x1a\n" + bytes(100) + b"IEND"])
def test_what_is_no_image_is_named(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "bad.png").write_bytes(content)
    with pytest.raises(InputError, match=r"bad\.png"):
        read(tmp_path / "bad.png")


def test_a_folder_gives_its_images_in_natural_order(tmp_path: Path) -> None:
    for name in ("img10.png", "img2.png", "IMG1.PNG", "notes.txt", "camera.h5"):
        (tmp_path / name).write_bytes(b"x")
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "other.png").write_bytes(b"x")
    assert [file.name for file in find_images(tmp_path)] == ["IMG1.PNG", "img2.png", "img10.png"]


def test_globs_files_and_folders_have_unique_names(tmp_path: Path) -> None:
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "1.png").write_bytes(b"x")
    assert [f.name for f in find_images(str(tmp_path / "*" / "*.png"))] == ["a/1.png", "b/1.png"]
    twice = find_images([tmp_path / "a", tmp_path / "a" / "1.png"])
    assert [f.name for f in twice] == ["1.png", "1.png (2)"]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("none.png", "no such file"),
        ("*.jpg", "no file matches"),
        (".", "has no image files"),
        ("", r"is empty; the current folder is called \."),
    ],
)
def test_nothing_found_says_what(given: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=message):
        find_images(given)


def test_of_a_folder_with_images_in_its_folders_those_are_named(tmp_path: Path) -> None:
    for name in ("left", "right", "notes"):
        (tmp_path / name).mkdir()
        (tmp_path / name / ("1.txt" if name == "notes" else "1.png")).write_bytes(b"x")
    with pytest.raises(InputError, match=r"no image files .* name one of them \(left, right\)"):
        find_images(tmp_path)


def test_written_images_are_lossless(tmp_path: Path) -> None:
    write_image(RAMP, tmp_path / "w.png")
    np.testing.assert_array_equal(read(tmp_path / "w.png"), RAMP)


def test_a_damaged_png_is_one_clear_line_and_none_of_the_decoders(tmp_path: Path, capfd) -> None:
    data = bytearray(cv2.imencode(".png", np.random.default_rng(0).integers(0, 255, (99, 88)).astype(np.uint8))[1])
    for place in (20, len(data) // 2):
        data[place] ^= 0x5A
        (tmp_path / "hit.png").write_bytes(data)
        with pytest.raises(InputError, match=r"hit\.png is damaged.*copy it again"):
            read(tmp_path / "hit.png")
    assert capfd.readouterr() == ("", "")


def test_of_several_pages_none_is_taken_silently(tmp_path: Path) -> None:
    cv2.imwritemulti(str(tmp_path / "two.tif"), [np.zeros((20, 30), np.uint8)] * 2)
    with pytest.raises(InputError, match=r"two\.tif has 2 pages"):
        read(tmp_path / "two.tif")


def test_pages_that_lie_in_one_another_are_not_counted_for_minutes(tmp_path: Path) -> None:
    entries, pages = 65_535, 1000
    data = bytearray(8 + 12 * (entries + pages) + 8)
    data[:8] = b"II*\0" + struct.pack("<I", 8)
    for page in range(pages):
        at = 8 + 12 * page
        struct.pack_into("<H", data, at, entries)
        struct.pack_into("<I", data, at + 2 + 12 * entries, at + 12)
    path = tmp_path / "endless.tif"
    path.write_bytes(data)
    with pytest.raises(InputError, match=r"endless\.tif cannot be read as an image"):
        read(path)


def test_a_preview_in_a_tiff_is_no_page(tmp_path: Path) -> None:
    path = tmp_path / "previewed.tif"
    cv2.imwritemulti(str(path), [np.full((20, 30), 7, np.uint8), np.zeros((5, 5), np.uint8)])
    data = bytearray(path.read_bytes())
    (first,) = struct.unpack_from("<I", data, 4)
    (entries,) = struct.unpack_from("<H", data, first)
    (second,) = struct.unpack_from("<I", data, first + 2 + 12 * entries)
    struct.pack_into("<HHII", data, second + 2, 254, 4, 1, 1)  # its first entry says: a reduced image
    path.write_bytes(data)
    assert (read(path) == 7).all()


def test_a_name_that_is_no_text_is_escaped(tmp_path: Path) -> None:
    try:
        (tmp_path / "a\udcff\n.png").write_bytes(b"x")
    except (OSError, UnicodeError):
        pytest.skip("this system has no such names")
    (found,) = find_images(tmp_path)
    assert found.name == "a\\udcff\n.png"
    assert found.path.read_bytes() == b"x"
