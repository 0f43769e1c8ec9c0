"""Finding a camera, having it alone, and making it ready to photograph."""

import logging
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from opencsp_calib import InputError
from opencsp_calib_basler import features
from opencsp_calib_basler.sentences import busy, is_busy, sentence

__all__ = ["PACKET_HINT", "connected", "held_alone", "make_ready", "serial_numbers"]

log = logging.getLogger("opencsp_calib.basler")

AUTO_EXPOSURE_S = 5.0  # longer than any camera needs
SETTLED_FRAMES = 10
REGION = (("OffsetX", features.lowest), ("OffsetY", features.lowest))
SIDES = (("Width", features.highest), ("Height", features.highest))
SMALL_PACKET = 1500  # bytes; what an adapter without jumbo frames carries
PACKET_HINT = "if frames get lost, set the adapter's MTU to 9000 (jumbo frames) and --set GevSCPSPacketSize=8192"


def serial_numbers() -> list[str]:
    """Of the cameras connected, and of those emulated where PYLON_CAMEMU is set."""
    from pypylon import pylon

    return [info.GetSerialNumber() for info in pylon.TlFactory.GetInstance().EnumerateDevices()]


@contextmanager
def held_alone(serial: str) -> Iterator[None]:
    """Refuses a camera that another of our own processes has: the SDK does so too, but not for emulated ones."""
    from filelock import FileLock, Timeout

    lock = FileLock(Path(tempfile.gettempdir()) / f"opencsp-calib-camera-{serial}.lock", mode=0o666)
    try:
        lock.acquire(timeout=0)
    except (Timeout, PermissionError):
        raise InputError(busy(serial)) from None
    try:
        yield
    finally:
        lock.release()


def connected(serial: str) -> Any:
    """The camera of that serial number, opened; InputError where there is none, or it cannot be had."""
    from pypylon import genicam, pylon

    there = serial_numbers()
    if serial not in there:
        others = f"connected are {', '.join(there)}" if there else "no Basler camera is connected"
        wanted = f"there is no Basler camera {serial!r}; " if serial else ""
        raise InputError(
            f"{wanted}{others}: check cable and power, and on GigE that camera and "
            "adapter are in the same subnet (Basler's pylon IP Configurator)"
        )
    info = pylon.DeviceInfo()
    info.SetSerialNumber(serial)
    factory = pylon.TlFactory.GetInstance()
    try:
        camera = pylon.InstantCamera(factory.CreateDevice(info))
        camera.Open()
    except genicam.GenericException as error:
        if is_busy(error):
            raise InputError(busy(serial)) from None
        raise InputError(f"the camera {serial} cannot be opened: {sentence(error)}") from None
    return camera


def make_ready(camera: Any, settings: Mapping[str, Any]) -> None:
    """Apply settings in order, then what they do not name: the whole sensor, free-running, exposure found and locked.

    What is set is told through the log.

    Raises
    ------
    InputError
        If the camera does not take a setting.
    """
    nodes = camera.GetNodeMap()
    done = [features.write(nodes, name, str(value)) for name, value in settings.items()]

    def named(*names: str) -> bool:
        return any(features.same_feature(name, given) for name in names for given in settings)

    for name, end in (*REGION, *SIDES):
        if features.exists(nodes, name) and not named(name):
            done.append(features.write(nodes, name, end(nodes, name)))
    for name, value in (("TriggerMode", "Off"), ("AcquisitionMode", "Continuous")):
        if features.read(nodes, name) not in ("", value) and not named(name):
            done.append(features.write(nodes, name, value))
    if features.exists(nodes, "ExposureAuto") and not named("ExposureTime", "ExposureAuto"):
        done.append(_exposure_found(camera, nodes))
    if features.read(nodes, "GainAuto") == "Continuous" and not named("GainAuto"):
        done.append(features.write(nodes, "GainAuto", "Off"))
    log.info("camera %s: %s", camera.GetDeviceInfo().GetSerialNumber(), ", ".join(done))
    _hint_at_packets(camera, nodes)


def _exposure_found(camera: Any, nodes: Any) -> str:
    """Let the camera find its exposure once, then lock it: a calibration needs photographs that are alike."""
    from pypylon import pylon

    if not (features.read(nodes, "TriggerMode") in ("", "Off") and _can(nodes, "ExposureAuto", "Once")):
        features.write(nodes, "ExposureAuto", "Off")
        return f"exposure locked at {features.read(nodes, 'ExposureTime')} us"
    features.write(nodes, "ExposureAuto", "Once")
    camera.StartGrabbing(pylon.GrabStrategy_LatestImageOnly)
    try:
        _wait_for_exposure(camera, nodes)
    finally:
        camera.StopGrabbing()
    features.write(nodes, "ExposureAuto", "Off")
    return f"ExposureAuto once, then locked at {features.read(nodes, 'ExposureTime')} us"


def _wait_for_exposure(camera: Any, nodes: Any) -> None:
    """Until the camera says that it is done, or the exposure does not change any more."""
    from pypylon import pylon

    end = time.monotonic() + AUTO_EXPOSURE_S
    exposures: list[str] = []
    while time.monotonic() < end and features.read(nodes, "ExposureAuto") != "Off":
        camera.RetrieveResult(int(1000 * AUTO_EXPOSURE_S), pylon.TimeoutHandling_Return).Release()
        exposures.append(features.read(nodes, "ExposureTime"))
        if len(exposures) > SETTLED_FRAMES and len(set(exposures[-SETTLED_FRAMES:])) == 1:
            break


def _can(nodes: Any, name: str, value: str) -> bool:
    return value in nodes.GetNode(name).GetSymbolics()


def _hint_at_packets(camera: Any, nodes: Any) -> None:
    packet = features.read(nodes, "GevSCPSPacketSize")
    if camera.GetDeviceInfo().GetDeviceClass() == "BaslerGigE" and int(packet or SMALL_PACKET) <= SMALL_PACKET:
        log.warning("GigE packets of %s bytes: %s", packet, PACKET_HINT)
