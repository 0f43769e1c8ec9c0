"""COLMAP's cameras.txt and cameras.bin, of all camera models.

The centre of the upper-left pixel is (0.5, 0.5) in every model, so half a pixel is taken from cx and cy. Which models
are ours, which are only fitted, and their formulas are in `colmap_models`.

Text: ``CAMERA_ID MODEL WIDTH HEIGHT PARAMS...``. Binary, little endian: u64 count; for each camera u32 id, i32 model,
u64 width, u64 height, f64 parameters as many as the model has. Where cameras stand (images, rigs, frames) is not
part of a camera.

Source: COLMAP documentation, "Output Format" and "Camera Models"; sensor/models.h.
"""

import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from opencsp_calib import Camera, InputError
from opencsp_calib.arrays import Params
from opencsp_calib.atomic import replacing
from opencsp_calib.counted import counted
from opencsp_calib.errors import FileFormatError
from opencsp_calib.interfaces import Imported
from opencsp_calib_formats.colmap_models import MODEL_OF_ID, PARAMETERS, imported
from opencsp_calib_formats.fields import number, whole
from opencsp_calib_formats.opencv_camera import carried
from opencsp_calib_formats.reading import FileFormat, TextFormat, comments, decimal, naming
from opencsp_calib_formats.safe_text import head, read_bytes, read_text

__all__ = ["ColmapBinary", "ColmapText"]

WRITTEN = {"pinhole": "PINHOLE", "opencv4": "OPENCV", "opencv8": "FULL_OPENCV", "opencv_fisheye": "OPENCV_FISHEYE"}
ID_OF_MODEL = {model: id_ for id_, model in MODEL_OF_ID.items()}
FITTED = ("FOV", "DIVISION", "EUCM", "THIN_PRISM_FISHEYE", "RAD_TAN_THIN_PRISM_FISHEYE")
RECORD = struct.Struct("<IiQQ")


class Entry(NamedTuple):
    """A camera as COLMAP has it."""

    id: int
    model: str
    width: int
    height: int
    params: tuple[float, ...]


class ColmapText(TextFormat):
    """Reads and writes cameras.txt."""

    name = "colmap"
    title = "COLMAP cameras.txt"
    extensions = (".txt",)
    models = ("pinhole", "opencv4", "opencv5", "opencv8", "opencv_fisheye")
    fitted = FITTED

    def recognises(self, path: Path) -> bool:
        """See `CameraFormat.recognises`: by the first line that is no comment."""
        words = next(_lines(head(path)), [])
        return len(words) > 4 and words[0].isdecimal() and words[1] in PARAMETERS and words[2].isdecimal()

    def read(self, path: Path) -> Mapping[str, Imported]:
        """See `CameraFormat.read`."""
        with naming(path):
            return _cameras([_of_words(words) for words in _lines(read_text(path))], path)

    def text(self, cameras: Mapping[str, Camera], path: Path, notes: Mapping[str, str]) -> str:
        """See `TextFormat.text`; names that are no numbers are replaced by 1, 2, ..."""
        entries = _entries(cameras, path, self.title)
        lines = ["# Camera list with one line of data per camera:", "#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]"]
        lines += [f"# Number of cameras: {len(entries)}", *comments(notes)]
        lines += [f"{e.id} {e.model} {e.width} {e.height} {' '.join(map(decimal, e.params))}" for e in entries]
        return "\n".join(lines) + "\n"


class ColmapBinary(FileFormat):
    """Reads and writes cameras.bin."""

    name = "colmap-bin"
    title = "COLMAP cameras.bin"
    extensions = (".bin",)
    writes = True
    models = ("pinhole", "opencv4", "opencv5", "opencv8", "opencv_fisheye")
    fitted = FITTED

    def recognises(self, path: Path) -> bool:
        """See `CameraFormat.recognises`: the count and the models must fill the file exactly."""
        try:
            return bool(_of_bytes(read_bytes(path)))
        except FileFormatError:
            return False

    def read(self, path: Path) -> Mapping[str, Imported]:
        """See `CameraFormat.read`."""
        with naming(path):
            return _cameras(_of_bytes(read_bytes(path)), path)

    def write(self, cameras: Mapping[str, Camera], path: Path) -> None:
        """See `CameraFormat.write`; names that are no numbers are replaced by 1, 2, ..."""
        entries = _entries(cameras, path, self.title)
        parts = [struct.pack("<Q", len(entries))]
        for e in entries:
            parts.append(RECORD.pack(e.id, ID_OF_MODEL[e.model], e.width, e.height))
            parts.append(struct.pack(f"<{len(e.params)}d", *e.params))
        with replacing(path) as temporary:
            temporary.write_bytes(b"".join(parts))


def _lines(text: str) -> Iterator[list[str]]:
    return (words for line in text.splitlines() if (words := line.split()) and not words[0].startswith("#"))


def _of_words(words: list[str]) -> Entry:
    if len(words) < 4:
        raise FileFormatError(f"the line {' '.join(words)[:60]!r} is no camera: CAMERA_ID MODEL WIDTH HEIGHT PARAMS...")
    id_, width, height = (whole(words[i], what) for i, what in ((0, "camera id"), (2, "width"), (3, "height")))
    params = tuple(number(word, f"parameter {i + 1} of camera {id_}") for i, word in enumerate(words[4:]))
    return Entry(id_, words[1], width, height, params)


def _of_bytes(data: bytes) -> list[Entry]:
    """The cameras of a binary file; the count is not believed before the file is long enough for it."""
    if len(data) < 8:
        raise FileFormatError("cut short: a COLMAP file has at least 8 bytes")
    (count,) = struct.unpack_from("<Q", data)
    if count * RECORD.size > len(data):
        raise FileFormatError(f"claims {counted(count, 'camera')} in {len(data)} bytes")
    offset, entries = 8, []
    for index in range(count):
        if offset + RECORD.size > len(data):
            raise FileFormatError(f"cut short in camera {index + 1} of {count}")
        id_, model_id, width, height = RECORD.unpack_from(data, offset)
        offset += RECORD.size
        if model_id not in MODEL_OF_ID:
            raise FileFormatError(f"camera {id_} has the unknown model {model_id}")
        model = MODEL_OF_ID[model_id]
        if offset + 8 * len(PARAMETERS[model]) > len(data):
            raise FileFormatError(f"cut short in camera {index + 1} of {count}")
        params = struct.unpack_from(f"<{len(PARAMETERS[model])}d", data, offset)
        offset += 8 * len(params)
        entries.append(Entry(id_, model, width, height, tuple(number(p, f"parameter of camera {id_}") for p in params)))
    if offset != len(data):
        raise FileFormatError(f"{len(data) - offset} bytes after the last camera")
    return entries


def _cameras(entries: list[Entry], path: Path) -> dict[str, Imported]:
    cameras: dict[str, Imported] = {}
    for entry in entries:
        key = str(entry.id)
        if key in cameras:
            raise FileFormatError(f"camera {key} is there twice")
        name = path.stem if len(entries) == 1 else f"{path.stem} {key}"
        cameras[key] = imported(name, entry.model, entry.params, (entry.width, entry.height))
    return cameras


def _entries(cameras: Mapping[str, Camera], path: Path, title: str) -> list[Entry]:
    if not cameras:
        raise InputError(f"cannot write {path}: no camera")
    numbered = all(key.isdecimal() and str(int(key)) == key and int(key) < 2**31 for key in cameras)
    entries = []
    for index, (key, camera) in enumerate(cameras.items(), start=1):
        model, coefficients = carried(camera, tuple(WRITTEN), path, title)
        params: Params = camera.params[:4].copy()
        params[2:] += 0.5
        values = (*params.tolist(), *coefficients.tolist())
        entries.append(Entry(int(key) if numbered else index, WRITTEN[model], *camera.image_size, values))
    return entries
