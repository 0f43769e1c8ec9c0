"""Promises of a camera format: what it writes it reads as the same camera, and it refuses what it does not carry.

That a format keeps the other program's conventions cannot be seen from what it writes itself: give files made by that
program, with the cameras that are in them, as `Setup.samples`.
"""

import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from opencsp_calib.arrays import Points
from opencsp_calib.camera import Camera
from opencsp_calib.conformance.kit import Setup, promise
from opencsp_calib.conformance.worlds import camera_of
from opencsp_calib.errors import FileFormatError, InputError
from opencsp_calib.interfaces import CameraFormat, Imported
from opencsp_calib.models import LENS_MODELS

__all__ = ["CHECKS", "SAME_PX"]

SAME_PX = 1e-6  # a camera that went through a file: what ten printed digits of a parameter lose
PREFIXES = (b"", b"\x00", b"\x89HDF\r\n\x1a\n", b"%YAML:1.0\n", b"{", b"<?xml version='1.0'?>\n<a>", b"# Camera list\n")


def says_what_it_carries(camera_format: CameraFormat, setup: Setup) -> None:
    """A title, extensions that begin with a dot, lens models of ours, and that it reads or writes."""
    promise(camera_format.title.strip(), "it has no title")
    dotted = all(e.startswith(".") and e == e.lower() and len(e) > 1 for e in camera_format.extensions)
    promise(camera_format.extensions and dotted, f"extensions are like .yaml, not {camera_format.extensions}")
    promise(camera_format.reads or camera_format.writes, "it neither reads nor writes")
    strange = sorted(set(camera_format.models) - set(LENS_MODELS))
    promise(not strange, f"it carries lens models that there are not: {strange}")
    promise(camera_format.models or not camera_format.writes, "it writes, but carries no lens model")


def reads_what_it_writes(camera_format: CameraFormat, setup: Setup) -> None:
    """Every lens model that it carries comes back, maybe with zeros added, projecting alike to `SAME_PX`."""
    if not (camera_format.reads and camera_format.writes):
        return
    with _folder() as folder:
        for model in camera_format.models:
            for camera in _cameras(model):
                path = _written(camera_format, camera, folder)
                promise(camera_format.recognises(path), f"it does not recognise its own file of {model!r}")
                read = camera_format.read(path)
                promise(len(read) == 1, f"it wrote one camera and reads {len(read)}")
                _promise_same(next(iter(read.values())), camera, f"{model!r}, written and read")


def reads_other_programs_files(camera_format: CameraFormat, setup: Setup) -> None:
    """The samples of the setup hold the cameras that are known to be in them."""
    if not camera_format.reads:
        return
    for path, cameras in setup.samples.items():
        promise(camera_format.recognises(path), f"it does not recognise {path.name}")
        read = camera_format.read(path)
        promise(set(read) == set(cameras), f"{path.name} has the cameras {sorted(cameras)}, it reads {sorted(read)}")
        for name, camera in cameras.items():
            _promise_same(read[name], camera, f"camera {name!r} of {path.name}")


def recognises_only_its_own(camera_format: CameraFormat, setup: Setup) -> None:
    """No other bytes, no folder, no missing file; it never raises and never writes."""
    rng = np.random.default_rng(2)
    with _folder() as folder:
        strange = [folder, folder / "is not there"]
        for number, prefix in enumerate(PREFIXES):
            strange.append(folder / f"{number}{camera_format.extensions[0]}")
            strange[-1].write_bytes(prefix + rng.bytes(200 * (number % 2)))
        for path in strange:
            try:
                recognised = camera_format.recognises(path)
            except Exception as error:
                raise AssertionError(f"recognises() raises {error!r}; it must not, for any path") from error
            promise(recognised is False, f"it says {recognised!r} of a file that is none of its own ({path.name})")


def refuses_damaged_files(camera_format: CameraFormat, setup: Setup) -> None:
    """What cannot be read is a FileFormatError of one line, wherever the file is cut or struck; nothing else."""
    if not camera_format.reads:
        return
    rng = np.random.default_rng(3)
    with _folder() as folder:
        whole = [path.read_bytes() for path in setup.samples]
        if camera_format.writes:
            whole.append(_written(camera_format, _cameras(camera_format.models[0])[0], folder).read_bytes())
        damaged = [prefix + rng.bytes(100) for prefix in PREFIXES]
        for content in whole:
            damaged += [content[: int(part * len(content))] for part in np.linspace(0.0, 0.99, 25)]
            damaged += [_struck(content, rng) for _ in range(50)]
        for content in damaged:
            path = folder / f"damaged{camera_format.extensions[0]}"
            path.write_bytes(content)
            _promise_read_or_refused(camera_format, path)


def refuses_what_it_does_not_carry(camera_format: CameraFormat, setup: Setup) -> None:
    """A lens model that is none of its own, or no camera at all, is an InputError, and no file is left."""
    if not camera_format.writes:
        return
    with _folder() as folder:
        path = folder / f"refused{camera_format.extensions[0]}"
        path.write_text("what was there before")
        for model in sorted(set(LENS_MODELS) - set(camera_format.models)):
            _promise_refused(camera_format, {"camera": camera_of(model)}, path, f"a camera of model {model!r}")
        _promise_refused(camera_format, {}, path, "no camera")
        promise(path.read_text() == "what was there before", "it spoils the file that is there when it refuses")
        promise([p.name for p in folder.iterdir()] == [path.name], "it leaves files behind when it refuses")


def keeps_cameras_apart(camera_format: CameraFormat, setup: Setup) -> None:
    """Several cameras in one file come back under as many names, in their order; or they are refused."""
    if not (camera_format.reads and camera_format.writes):
        return
    cameras = {"left": _cameras(camera_format.models[0])[0], "right": _cameras(camera_format.models[0])[1]}
    with _folder() as folder:
        path = folder / f"two{camera_format.extensions[0]}"
        try:
            camera_format.write(cameras, path)
        except InputError:
            promise(not path.exists(), "it refuses two cameras and leaves a file")
            return
        read = list(camera_format.read(path).values())
        promise(len(read) == 2, f"it wrote two cameras and reads {len(read)}")
        for imported, (name, camera) in zip(read, cameras.items(), strict=True):
            _promise_same(imported, camera, f"camera {name!r} of two")


CHECKS = (
    says_what_it_carries,
    reads_what_it_writes,
    reads_other_programs_files,
    recognises_only_its_own,
    refuses_damaged_files,
    refuses_what_it_does_not_carry,
    keeps_cameras_apart,
)


@contextmanager
def _folder() -> Iterator[Path]:
    with tempfile.TemporaryDirectory(prefix="opencsp-calib-conformance-") as folder:
        yield Path(folder)


def _cameras(model: str) -> tuple[Camera, Camera]:
    """Two that no default or rounding makes up, one with a portrait image."""
    camera = camera_of(model)
    params = camera.params * np.pi / 3.0
    params[:4] = 731.123456789012, 730.987654321098, 377.111111111111, 511.222222222222
    return camera, replace(camera, name="portrait", params=params, image_size=(770, 1030))


def _written(camera_format: CameraFormat, camera: Camera, folder: Path) -> Path:
    path = folder / f"{camera.name}-{camera.model}{camera_format.extensions[0]}"
    camera_format.write({camera.name: camera}, path)
    promise(path.is_file(), f"it does not write {path.name}")
    return path


def _promise_same(imported: Imported, camera: Camera, what: str) -> None:
    if imported.camera is None and imported.resize is not None:
        imported = imported.resize(camera.image_size)  # a format without image size
    promise(imported.camera is not None, f"{what}: it is not exact, for {', '.join(imported.obstacles) or 'no reason'}")
    read = imported.camera or camera
    promise(_contains(read, camera), f"{what}: the lens model {camera.model!r} has become {read.model!r}")
    promise(read.image_size == camera.image_size, f"{what}: the image {camera.image_size} is {read.image_size}")
    points = _points(camera)
    truth = camera.project(points)
    off = np.abs(read.project(points) - truth).max()
    promise(off <= SAME_PX, f"{what}: it projects {off:.3g} px elsewhere (half a pixel: whose pixel centre is at 0?)")
    promise(imported.project is not None, f"{what}: it has no projection")
    if imported.project is not None:
        off = np.abs(imported.project(points) - truth).max()
        promise(off <= SAME_PX, f"{what}: its projection and its camera differ by {off:.3g} px")


def _contains(read: Camera, camera: Camera) -> bool:
    """Whether the coefficients are those of the camera, in order, and then zeros: formats know fewer models than we."""
    count = len(camera.distortion)
    same_order = read.lens.distortion_names[:count] == camera.lens.distortion_names
    return read.model == camera.model or (same_order and not read.distortion[count:].any())


def _points(camera: Camera) -> Points:
    """In front of the camera, all over the image, at several distances."""
    width, height = camera.image_size
    x, y = np.meshgrid(np.linspace(0.0, width - 1.0, 9), np.linspace(0.0, height - 1.0, 9))
    rays = camera.unproject(np.column_stack([x.ravel(), y.ravel()]))
    rays = rays[np.isfinite(rays).all(axis=1)]
    return np.asarray(rays * np.linspace(0.5, 5.0, len(rays))[:, None])


def _struck(content: bytes, rng: np.random.Generator) -> bytes:
    """With a few bytes changed."""
    struck = bytearray(content)
    for place in rng.integers(0, len(content), 3):
        struck[place] = int(rng.integers(0, 256))
    return bytes(struck)


def _promise_read_or_refused(camera_format: CameraFormat, path: Path) -> None:
    try:
        camera_format.read(path)
    except FileFormatError as error:
        promise(str(error).strip() and "\n" not in str(error), f"the message {str(error)!r} is not one line")
    except Exception as error:
        start = path.read_bytes()[:60]
        raise AssertionError(f"a damaged file ({start!r} ...) raises {error!r}, not a FileFormatError") from error


def _promise_refused(camera_format: CameraFormat, cameras: Mapping[str, Camera], path: Path, what: str) -> None:
    try:
        camera_format.write(cameras, path)
    except InputError:
        return
    except Exception as error:
        raise AssertionError(f"asked to write {what}, it raises {error!r}; it must be an InputError") from error
    raise AssertionError(f"it writes {what}, which it does not carry")
