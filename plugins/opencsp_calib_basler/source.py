"""The image source ``basler``: any Basler camera that pylon knows, or its camera emulation."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from typing import Any

from opencsp_calib import Image, InputError

__all__ = ["BaslerSource"]


class BaslerSource:
    """Basler cameras by serial number, through pypylon.

    Settings are features of the camera by their standard names (``ExposureTime=5000``, ``PixelFormat=Mono12``), applied
    in the order given. What they do not name is made ready: offsets 0, then width and height to their maxima, no
    trigger, exposure found once and locked. Without a camera, ``PYLON_CAMEMU=1`` in the environment emulates one.
    """

    name = "basler"

    def missing(self) -> str | None:
        """See `Provided.missing`."""
        if find_spec("pypylon") is None or find_spec("filelock") is None:
            return "it needs Basler's SDK: pip install 'opencsp-calib[basler]'"
        return None

    def devices(self) -> Sequence[str]:
        """Serial numbers of the cameras connected."""
        from opencsp_calib_basler.opening import serial_numbers

        return serial_numbers()

    @contextmanager
    def open(self, device: str, **settings: Any) -> Iterator[Iterator[Image]]:
        """The images of a camera; InputError where it is not there, in use, or does not take a setting."""
        from opencsp_calib_basler.opening import connected, held_alone, make_ready
        from opencsp_calib_basler.stream import Stream

        def connect() -> Any:
            camera = connected(device)
            try:
                make_ready(camera, settings)
            except InputError:
                camera.Close()
                raise
            return camera

        with held_alone(device):
            stream = Stream(connect, device)
            try:
                yield stream
            finally:
                stream.close()
