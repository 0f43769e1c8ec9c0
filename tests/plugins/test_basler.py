"""The Basler source on Basler's real SDK with its camera emulation: two cameras that send the images of a folder."""

import logging
import os
import subprocess
import sys
import time
from itertools import islice

import numpy as np
import pytest

os.environ.setdefault("PYLON_CAMEMU", "2")  # read once, when the SDK is loaded
pylon = pytest.importorskip("pypylon.pylon", reason="Basler's SDK is not installed")

from opencsp_calib_basler import features  # noqa: E402
from opencsp_calib_basler.opening import connected  # noqa: E402
from opencsp_calib_basler.sentences import is_busy, sentence  # noqa: E402
from opencsp_calib_basler.source import BaslerSource  # noqa: E402

from opencsp_calib import InputError  # noqa: E402
from opencsp_calib.conformance import parametrize_checks  # noqa: E402
from opencsp_calib.images import write_image  # noqa: E402

pytestmark = pytest.mark.usefixtures("emulated_cameras")

SOURCE = BaslerSource()
FIRST, SECOND = "0815-0000", "0815-0001"
SMALL = {"Width": 64, "Height": 48}


@parametrize_checks(SOURCE, device=FIRST, settings=SMALL)
def test_conforms(provided, check):
    check(provided)


@pytest.fixture(autouse=True)
def patience(monkeypatch):
    """However busy the machine is, which emulates the cameras too, frames come in time."""
    monkeypatch.setattr("opencsp_calib_basler.stream.SPARE_S", 120.0)


@pytest.fixture
def scene(tmp_path):
    """Settings that make the emulation send one known image, with levels of all heights."""
    pixels = np.add.outer(np.arange(48) * 4, np.arange(64)).astype(np.uint8)
    write_image(pixels, tmp_path / "scene.png")
    return pixels, {"ImageFilename": str(tmp_path), "ImageFileMode": "On", "TestImageSelector": "Off"}


@pytest.fixture
def nodes():
    camera = connected(SECOND)
    yield camera.GetNodeMap()
    camera.Close()


def taken(count=1, device=FIRST, **settings):
    with SOURCE.open(device, **settings) as images:
        return list(islice(images, count))


def test_devices_are_listed_by_serial_number():
    assert list(SOURCE.devices()) == [FIRST, SECOND]


def test_the_whole_sensor_is_taken_unless_named(scene, caplog):
    pixels, settings = scene
    caplog.set_level(logging.INFO, "opencsp_calib.basler")
    (image,) = taken(**settings)
    np.testing.assert_array_equal(image.pixels, pixels)
    assert "OffsetX = 0, OffsetY = 0, Width = 4096, Height = 4096" in caplog.text
    (region,) = taken(Width=40, Height=30, OffsetX=8, OffsetY=4, **settings)
    assert region.size == (40, 30)
    assert (region.record["OffsetX"], region.record["OffsetY"]) == ("8", "4")
    (whole,) = taken(**settings)  # whatever the camera was left with
    assert whole.size == (64, 48)


def test_settings_are_applied_in_the_order_given(caplog):
    caplog.set_level(logging.INFO, "opencsp_calib.basler")
    (image,) = taken(Height=90, OffsetX=8, ExposureTime=3000, Width=100)
    assert image.size == (100, 90)
    assert "Height = 90, OffsetX = 8, ExposureTime = 3000.0, Width = 100, OffsetY = 0" in caplog.text


def test_binning_and_exposure_are_recorded():
    (image,) = taken(BinningHorizontal=2, BinningVertical=2, ExposureTime=2500, **SMALL)
    assert (image.record["BinningHorizontal"], image.record["ExposureTime"]) == ("2", "2500.0")
    assert image.record["serial"] == FIRST


@pytest.mark.parametrize(("pixel_format", "shift"), [("Mono10", 6), ("Mono12", 4), ("Mono16", 0)])
def test_deep_formats_keep_every_bit_and_saturate_at_the_top(scene, pixel_format, shift):
    """As the SDK's own buffer has them, shifted up so that the highest level is that of 16 bits."""
    _, settings = scene
    (image,) = taken(PixelFormat=pixel_format, **settings)
    camera = connected(SECOND)
    for name, value in (*settings.items(), ("PixelFormat", pixel_format)):
        features.write(camera.GetNodeMap(), name, value)
    camera.StartGrabbing(1)
    frame = camera.RetrieveResult(60000)
    raw = frame.Array.copy()
    frame.Release()
    camera.Close()
    assert image.pixels.dtype == np.uint16
    np.testing.assert_array_equal(image.pixels, raw[: image.size[1], : image.size[0]].astype(np.uint16) << shift)


@pytest.mark.parametrize(
    ("pixel_format", "dtype"), [("BayerRG8", np.uint8), ("BayerGB12", np.uint16), ("RGB8Packed", np.uint8)]
)
def test_colour_becomes_grey(scene, pixel_format, dtype):
    """A grey ramp stays one, but for the Bayer pattern's interpolation at the border."""
    pixels, settings = scene
    (image,) = taken(PixelFormat=pixel_format, **settings)
    assert image.pixels.dtype == dtype
    seen = image.pixels / image.white * 255
    assert np.corrcoef(seen[4:-4, 4:-4].ravel(), pixels[4:-4, 4:-4].ravel())[0, 1] > 0.99


@pytest.mark.parametrize("name", ["ExposureTime", "ExposureTimeAbs", "ExposureTimeRaw"])
def test_every_familys_name_is_understood(nodes, name):
    assert features.write(nodes, name, "4000").startswith(name)
    assert float(features.read(nodes, name)) == 4000


class OnlyNodes:
    """The real camera's nodes, but only those of a family that knows some of them by other names."""

    def __init__(self, nodes, without):
        self.nodes, self.without = nodes, without

    def GetNode(self, name):
        return None if name in self.without else self.nodes.GetNode(name)


def test_a_family_without_the_standard_name_is_set_by_it(nodes):
    classic = OnlyNodes(nodes, {"ExposureTime", "AcquisitionFrameRate"})
    assert features.write(classic, "ExposureTime", "5000") == "ExposureTimeAbs = 5000"
    assert features.write(classic, "AcquisitionFrameRate", "20") == "AcquisitionFrameRateAbs = 20"
    raw = OnlyNodes(nodes, {"ExposureTime", "ExposureTimeAbs", "Gain"})
    nodes.GetNode("ExposureTimeBaseAbs").FromString("2")
    assert features.write(raw, "ExposureTime", "6000") == "ExposureTimeRaw = 3000"
    assert float(features.read(raw, "ExposureTime")) == 6000
    assert features.write(raw, "Gain", "250") == "GainRaw = 250"


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"Sharpnes": 3}, "no feature 'Sharpnes'"),
        ({"PixelFormat": "Foo"}, "does not take PixelFormat=Foo"),
        ({"ExposureTime": "abc"}, "does not take ExposureTime=abc"),
        ({"SensorWidth": 5}, "does not take SensorWidth=5: Node is not writable"),
    ],
)
def test_a_setting_that_cannot_be_is_one_sentence(setting, message):
    with pytest.raises(InputError, match=message) as caught:
        taken(**setting)
    assert "\n" not in str(caught.value)


def test_an_unknown_camera_names_those_there_are():
    with pytest.raises(InputError, match=f"no Basler camera '4711'; connected are {FIRST}, {SECOND}"):
        taken(device="4711")


def test_without_any_camera_it_says_so():
    """In a process of its own, since the SDK reads PYLON_CAMEMU once."""
    code = "from opencsp_calib_basler.source import BaslerSource as B\nwith B().open('4711') as images: next(images)"
    environment = {**os.environ, "PYLON_CAMEMU": "0"}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment)
    assert "InputError: there is no Basler camera '4711'; no Basler camera is connected" in done.stderr


HOLD = """
import sys
from opencsp_calib_basler.source import BaslerSource
with BaslerSource().open(sys.argv[1], Width=64, Height=48) as images:
    next(images)
    print("held", flush=True)
    sys.stdin.read()
"""


def test_a_camera_that_a_second_process_has_is_busy():
    holder = subprocess.Popen(
        [sys.executable, "-c", HOLD, FIRST], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    with holder:
        assert holder.stdout.readline() == "held\n"
        with pytest.raises(InputError, match=f"the camera {FIRST} is in use by another program"):
            taken(**SMALL)
        assert taken(device=SECOND, **SMALL)
        holder.stdin.close()
    assert taken(**SMALL)


def test_what_the_sdk_says_of_a_busy_camera_is_understood():
    """Emulated cameras are never busy for the SDK; these are its messages for USB and for GigE."""
    usb = RuntimeError(
        "The device is exclusively opened by another client. : RuntimeException thrown (file 'x', line 3)"
    )
    gige = RuntimeError("Failed to open device. Error: 'The device is controlled by another application.' (0xE1018006)")
    assert is_busy(usb)
    assert is_busy(gige)
    assert not is_busy(RuntimeError("No device is available"))
    assert sentence(usb) == "The device is exclusively opened by another client"


def test_incomplete_frames_are_taken_again_and_counted(caplog):
    (image,) = taken(ForceFailedBufferCount=3, ForceFailedBuffer=1, ExposureTime=1000, **SMALL)
    assert image.record["incomplete frames before it"] == "3"
    assert "jumbo frames" in caplog.text


def test_nothing_but_incomplete_frames_ends_in_a_sentence():
    with pytest.raises(InputError, match="30 frames in a row of camera 0815-0000 were incomplete"):
        taken(ForceFailedBufferCount=100, ForceFailedBuffer=1, **SMALL)


def test_no_image_in_time_ends_in_a_sentence(monkeypatch):
    monkeypatch.setattr("opencsp_calib_basler.stream.SPARE_S", 2.0)
    with pytest.raises(InputError, match=r"sent no image for 2\.\d s: it waits for a trigger \(Software\)"):
        taken(TriggerMode="On", **SMALL)


def test_only_the_latest_image_is_given():
    """After a pause of ten frames no more than one waits."""
    with SOURCE.open(FIRST, AcquisitionFrameRate=20, **SMALL) as images:
        next(images)
        camera = images._camera
        received = camera.GetStreamGrabberNodeMap().GetNode("Statistic_Total_Buffer_Count")
        before = received.GetValue()
        while received.GetValue() < before + 10:
            time.sleep(0.01)
        assert camera.NumReadyBuffers.Value <= 1


def test_a_camera_that_was_gone_goes_on(caplog):
    """The device is closed beneath the stream, which is what it finds when the cable was pulled and put back."""
    with SOURCE.open(FIRST, **SMALL) as images:
        first = next(images)
        images._camera.Close()
        second = next(images)
    assert first.size == second.size
    assert first.name != second.name
    assert "is gone: put its cable back" in caplog.text
    assert "is back" in caplog.text
