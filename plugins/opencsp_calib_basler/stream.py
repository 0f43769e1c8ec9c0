"""The images of an open camera as they come, with what goes wrong on the way put right or said in one sentence."""

import logging
import time
from collections.abc import Callable, Iterator
from datetime import datetime, timezone
from typing import Any

from opencsp_calib import Image, InputError
from opencsp_calib_basler import features
from opencsp_calib_basler.opening import PACKET_HINT
from opencsp_calib_basler.pixels import GreyLevels
from opencsp_calib_basler.sentences import sentence

__all__ = ["Stream"]

log = logging.getLogger("opencsp_calib.basler")

SPARE_S = 2.0  # beyond exposure and frame period: transfer, and a host that is busy
MOST_INCOMPLETE = 30  # frames in a row
REPLUG_S = 60.0  # how long a camera that is gone is waited for
RECORDED = ("ExposureTime", "Gain", "PixelFormat", "BinningHorizontal", "BinningVertical", "OffsetX", "OffsetY")


class Stream(Iterator[Image]):
    """An iterator over what the camera sees now: always the latest frame, never one that waited.

    Parameters
    ----------
    connect : callable
        Gives the camera, open and ready; called again where the cable was pulled and put back.
    serial : str
    """

    def __init__(self, connect: Callable[[], Any], serial: str) -> None:
        self._connect, self._serial = connect, serial
        self._grey = GreyLevels()
        self._count, self.incomplete = 0, 0
        self._camera = connect()
        self._start()

    def __next__(self) -> Image:
        in_a_row = 0
        while True:
            frame = self._frame()
            if frame is None:
                self._reconnect()
                continue
            try:
                if frame.GrabSucceeded():
                    self._count += 1
                    return self._image(frame)
                in_a_row += 1
                self._note_incomplete(frame.ErrorDescription, in_a_row)
            finally:
                frame.Release()

    def close(self) -> None:
        """Stop, and let the camera go."""
        from pypylon import genicam

        try:
            self._camera.StopGrabbing()
            self._camera.Close()
        except genicam.GenericException as error:  # it may have been pulled
            log.info("camera %s: %s", self._serial, sentence(error))

    def _start(self) -> None:
        from pypylon import pylon

        nodes = self._camera.GetNodeMap()
        self._record = {name: value for name in RECORDED if (value := features.read(nodes, name))}
        self._record = {"camera": self._camera.GetDeviceInfo().GetModelName(), "serial": self._serial} | self._record
        exposure_s = float(self._record.get("ExposureTime", "0")) * 1e-6
        rate = float(features.read(nodes, "ResultingFrameRate") or features.read(nodes, "AcquisitionFrameRate") or "0")
        self._timeout_s = SPARE_S + 2.0 * exposure_s + (2.0 / rate if rate > 0 else 0.0)
        self._camera.StartGrabbing(pylon.GrabStrategy_LatestImageOnly)

    def _frame(self) -> Any:
        """The latest; None where the connection is lost."""
        from pypylon import genicam, pylon

        if self._camera.IsCameraDeviceRemoved() or not self._camera.IsGrabbing():
            return None
        try:
            return self._camera.RetrieveResult(int(1000 * self._timeout_s), pylon.TimeoutHandling_ThrowException)
        except genicam.TimeoutException:
            if self._camera.IsCameraDeviceRemoved():
                return None
            raise InputError(self._why_nothing_came()) from None
        except genicam.GenericException as error:
            if self._camera.IsCameraDeviceRemoved() or not self._camera.IsOpen():
                return None
            raise InputError(f"the camera {self._serial} cannot go on: {sentence(error)}") from None

    def _why_nothing_came(self) -> str:
        nodes = self._camera.GetNodeMap()
        waited = f"the camera {self._serial} sent no image for {self._timeout_s:.1f} s"
        if features.read(nodes, "TriggerMode") == "On":
            source = features.read(nodes, "TriggerSource")
            return f"{waited}: it waits for a trigger ({source}); send one, or --set TriggerMode=Off"
        return f"{waited}: check the cable, and that no firewall stops its packets"

    def _note_incomplete(self, why: str, in_a_row: int) -> None:
        self.incomplete += 1
        gigabit = features.exists(self._camera.GetNodeMap(), "GevSCPSPacketSize")
        hint = f"; {PACKET_HINT}" if gigabit else ""
        if in_a_row >= MOST_INCOMPLETE:
            raise InputError(f"{in_a_row} frames in a row of camera {self._serial} were incomplete ({why}){hint}")
        if self.incomplete == 1:
            log.warning("a frame of camera %s was incomplete and is taken again (%s)%s", self._serial, why, hint)

    def _image(self, frame: Any) -> Image:
        pixels = self._grey.of(frame)
        record = self._record | {
            "Width": str(pixels.shape[1]),
            "Height": str(pixels.shape[0]),
            "incomplete frames before it": str(self.incomplete),
            "time": datetime.now(timezone.utc).isoformat(timespec="milliseconds"),
        }
        return Image(f"{self._serial}-{self._count:06d}", pixels, record=record)

    def _reconnect(self) -> None:
        log.warning(
            "the camera %s is gone: put its cable back; waiting for %.0f s, Ctrl-C stops", self._serial, REPLUG_S
        )
        end = time.monotonic() + REPLUG_S
        self._camera.DestroyDevice()
        while True:
            try:
                self._camera = self._connect()
                break
            except InputError:
                if time.monotonic() > end:
                    raise
                time.sleep(0.5)
        log.warning("the camera %s is back", self._serial)
        self._start()
