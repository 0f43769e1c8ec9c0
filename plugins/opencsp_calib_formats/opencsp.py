"""The camera file itself, ours and OpenCSP's: `opencsp_calib.hdf5` as a camera format."""

from collections.abc import Mapping
from pathlib import Path

from opencsp_calib import Camera, InputError
from opencsp_calib.hdf5 import read_camera, save_camera
from opencsp_calib.hdf5_reading import EXTENSIONS, opened
from opencsp_calib.interfaces import Imported
from opencsp_calib_formats.reading import FileFormat, naming, only_one

__all__ = ["OpenCSP"]


class OpenCSP(FileFormat):
    """Reads and writes one camera."""

    name = "opencsp"
    title = "OpenCSP camera (HDF5)"
    extensions = EXTENSIONS
    writes = True
    models = ("pinhole", "opencv4", "opencv5", "opencv8", "opencv12", "opencv14", "opencv_fisheye")

    def recognises(self, path: Path) -> bool:
        """See `CameraFormat.recognises`."""
        try:
            with opened(path) as file:
                return "Camera" in file and file.userblock_size == 0  # MATLAB has its own block before
        except InputError:
            return False

    def read(self, path: Path) -> Mapping[str, Imported]:
        """See `CameraFormat.read`."""
        with naming(path):
            camera, problems = read_camera(path)
            return {camera.name or "camera": Imported(camera, camera.image_size, camera.project, notes=problems)}

    def write(self, cameras: Mapping[str, Camera], path: Path) -> None:
        """See `CameraFormat.write`."""
        self.write_with_notes(cameras, path, {})

    def write_with_notes(self, cameras: Mapping[str, Camera], path: Path, notes: Mapping[str, str]) -> None:
        """See `KeepsNotes.write_with_notes`."""
        save_camera(only_one(cameras, path, self.title), path, notes)
