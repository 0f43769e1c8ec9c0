"""Image files: which there are, and their grey levels exactly as the sensor gave them.

With `opencsp_calib.subpix` and `opencsp_calib.undistortion` the only place in the core that calls OpenCV, which
`opencsp_calib.opencv` gives.
"""

import glob
import hashlib
import os
import re
import stat
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from opencsp_calib.atomic import replacing
from opencsp_calib.errors import InputError
from opencsp_calib.image import Image
from opencsp_calib.image_bytes import fault
from opencsp_calib.opencv import opencv

__all__ = [
    "EXTENSIONS",
    "MAX_BYTES",
    "EncodedImage",
    "ImageFile",
    "as_text",
    "decode_image",
    "encode_thumbnail",
    "find_images",
    "images_in",
    "natural_order",
    "read_encoded",
    "read_image",
    "reduced",
    "write_image",
]

EXTENSIONS = (".png", ".tif", ".tiff", ".jpg", ".jpeg", ".bmp", ".pgm", ".pnm", ".ppm", ".webp")
MAX_BYTES = 2**31
MAX_NAME = 255  # characters
MAX_FOLDERS = 5  # named in a message


@dataclass(frozen=True)
class ImageFile:
    """An image file to be looked at.

    Parameters
    ----------
    name : str
        What reports call it, unique within the set: its path below the folder all have in common.
    path : Path
    """

    name: str
    path: Path


@dataclass(frozen=True)
class EncodedImage:
    """An image file as it lies on the disk: not yet decoded, but known by its contents.

    Parameters
    ----------
    file : ImageFile
    data : bytes
    sha256 : str
        Of the bytes, hexadecimal.
    """

    file: ImageFile
    data: bytes = field(repr=False)
    sha256: str


def find_images(inputs: str | os.PathLike[str] | Iterable[str | os.PathLike[str]]) -> tuple[ImageFile, ...]:
    """The image files that files, folders and glob patterns name, in order.

    A folder gives its image files by extension, sorted naturally (2 before 10), not those of its subfolders; other
    files in it are passed over. A file named explicitly is taken whatever its extension.

    Raises
    ------
    InputError
        If something named does not exist, or there is no image at all.
    """
    given = [inputs] if isinstance(inputs, str | os.PathLike) else list(inputs)
    paths = [path for one in given for path in _expanded(os.fspath(one))]
    if not paths:
        raise InputError("no images were given")
    parents = {path.absolute().parent for path in paths}
    root = Path(os.path.commonpath(parents)) if len({parent.drive for parent in parents}) == 1 else None
    counts: dict[str, int] = {}
    files = []
    for path in paths:
        name = as_text(path.absolute().relative_to(root).as_posix() if root else str(path))
        counts[name] = counts.get(name, 0) + 1
        files.append(ImageFile(name if counts[name] == 1 else f"{name} ({counts[name]})", path))
    return tuple(files)


def as_text(name: str) -> str:
    """A file's name with bytes escaped that are no text in any alphabet, so that it can be written and drawn."""
    return name.encode("utf-8", "backslashreplace").decode()


def _expanded(text: str) -> list[Path]:
    if not text:  # which would be the current folder
        raise InputError("the name of an image or folder is empty; the current folder is called .")
    path = Path(text)
    if len(path.name) > MAX_NAME:
        raise InputError(f"no such file or folder: {text[:60]}... (the name is too long for a file)")
    if path.is_dir():
        found = images_in(path)
        if not found:
            inside = [one.name for one in sorted(path.iterdir()) if one.is_dir() and _has_images(one)]
            named = ", ".join([*inside[:MAX_FOLDERS], *["..."] * (len(inside) > MAX_FOLDERS)])
            hint = f", but those in it have: name one of them ({named})" if inside else ""
            raise InputError(f"the folder {path} has no image files ({', '.join(EXTENSIONS)}){hint}")
        return found
    if path.exists():
        return [path]
    if glob.has_magic(text):
        found = sorted((Path(p) for p in glob.glob(text) if Path(p).is_file()), key=natural_order)
        if not found:
            raise InputError(f"no file matches {text}")
        return found
    raise InputError(f"no such file or folder: {path}")


def images_in(folder: Path) -> list[Path]:
    """The image files of a folder by extension, sorted naturally; not hidden ones, such as files being written."""
    files = (path for path in folder.iterdir() if path.suffix.lower() in EXTENSIONS and not path.name.startswith("."))
    return sorted((path for path in files if path.is_file()), key=natural_order)


def _has_images(folder: Path) -> bool:
    try:
        return bool(images_in(folder))
    except OSError:  # not allowed to look into it
        return False


def natural_order(path: Path) -> list[tuple[int, str]]:
    """Sorts image2 before image10."""
    parts = re.split(r"([0-9]+)", path.as_posix())
    return [(int(part), "") if part.isdecimal() else (-1, part.lower()) for part in parts]


def read_image(file: ImageFile) -> Image:
    """The grey levels of an image file, 8 or 16 bit, colour turned to grey.

    Raises
    ------
    InputError
        If the file cannot be read, is empty, cut short, or no image; the message names it and the reason.
    MissingDependencyError
        If OpenCV is not installed.
    """
    return decode_image(read_encoded(file))


def read_encoded(file: ImageFile) -> EncodedImage:
    """The bytes of an image file.

    Raises
    ------
    InputError
        If it cannot be read, or is empty.
    """
    try:
        if not stat.S_ISREG(file.path.stat().st_mode):
            raise InputError(f"{file.path} is not a regular file")
        if file.path.stat().st_size > MAX_BYTES:
            raise InputError(f"{file.path} is larger than {MAX_BYTES >> 30} GiB")
        data = file.path.read_bytes()
    except OSError as error:
        raise InputError(f"{file.path} cannot be read: {error.strerror}") from None
    if not data:
        raise InputError(f"{file.path} is empty")
    return EncodedImage(file, data, hashlib.sha256(data).hexdigest())


def decode_image(encoded: EncodedImage) -> Image:
    """The grey levels in an image file's bytes.

    The pixels stay as the sensor has them: an orientation noted in the file (EXIF), which would turn them and swap
    width and height, is not followed.

    Raises
    ------
    InputError
        If they are cut short, damaged, several pages, or no image.
    MissingDependencyError
        If OpenCV is not installed.
    """
    cv2 = opencv()
    path, data = encoded.file.path, encoded.data
    against = fault(data)
    if against:
        raise InputError(f"{path} {against}")
    flags = cv2.IMREAD_GRAYSCALE | cv2.IMREAD_ANYDEPTH | cv2.IMREAD_IGNORE_ORIENTATION
    try:
        pixels = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), flags)
    except cv2.error as error:
        raise InputError(f"{path} cannot be read as an image: {error.err}") from None
    if pixels is None:
        raise InputError(f"{path} cannot be read as an image; it is damaged or of an unknown kind")
    if pixels.dtype not in (np.uint8, np.uint16):
        raise InputError(f"{path} has {pixels.dtype} pixels; save it with 8 or 16 bits")
    return Image(encoded.file.name, pixels, encoded.sha256)


def write_image(pixels: NDArray[Any], path: str | os.PathLike[str]) -> None:
    """Write grey levels losslessly as PNG, aside and then in place.

    Parameters
    ----------
    pixels : (height, width) uint8 or uint16
    path : path-like

    Raises
    ------
    InputError
        If it cannot be written.
    """
    cv2 = opencv()
    done, data = cv2.imencode(".png", pixels, [cv2.IMWRITE_PNG_COMPRESSION, 1])
    if not done:
        raise InputError(f"cannot write {path}: not an image of 8 or 16 bits")
    with replacing(path) as temporary:
        temporary.write_bytes(data.tobytes())


def reduced(image: Image, n: int) -> Image:
    """The image with n x n pixels averaged into one: (x, y) becomes ``(x + 1/2)/n - 1/2``; what is over is left out."""
    width, height = (side // n for side in image.size)
    whole = image.pixels[: height * n, : width * n]
    small = whole if n == 1 else opencv().resize(whole, (width, height), interpolation=opencv().INTER_AREA)
    return replace(image, pixels=small)


def encode_thumbnail(pixels: NDArray[Any], side: int) -> bytes:
    """A small JPEG of grey levels, at most `side` pixels either way, 16 bits brought to 8."""
    cv2 = opencv()
    scale = min(1.0, side / max(pixels.shape[:2]))
    small = cv2.resize(pixels, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA) if scale < 1 else pixels
    if small.dtype == np.uint16:
        small = (small / (max(int(small.max()), 1) / 255.0)).astype(np.uint8)
    return bytes(cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, 80])[1].tobytes())
