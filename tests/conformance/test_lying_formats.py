"""Camera formats that lie, one lie each."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lies import caught

from opencsp_calib.camera import Camera
from opencsp_calib.conformance import checks_of, parametrize_checks
from opencsp_calib.errors import FileFormatError, InputError
from opencsp_calib.importing import as_imported


class Format:
    """A small format of JSON, and no lie: the image size, the model and the parameters of each camera."""

    name = "small"
    title = "A small format"
    extensions = (".small",)
    reads = writes = True
    models = ("opencv4", "opencv5")

    def missing(self):
        return None

    def recognises(self, path):
        try:
            return json.loads(path.read_text()).get("small") == 1
        except (OSError, ValueError, AttributeError):
            return False

    def read(self, path):
        try:
            cameras = json.loads(path.read_text())["cameras"]
            return {name: as_imported(name, m, self.came(np.array(p, float)), tuple(s)) for name, m, p, s in cameras}
        except (OSError, ValueError, TypeError, KeyError, IndexError, AttributeError, InputError) as error:
            raise FileFormatError(f"{path}: {' '.join(str(error).split())}") from None

    def write(self, cameras, path):
        if not cameras or any(camera.model not in self.models for camera in cameras.values()):
            raise InputError("cannot be written")
        cameras = [(n, c.model, list(self.went(c.params.copy())), c.image_size) for n, c in cameras.items()]
        path.write_text(json.dumps({"small": 1, "cameras": cameras}))

    def went(self, params):
        return params

    def came(self, params):
        return params


class CornerOrigin(Format):
    def went(self, params):
        return params + np.eye(len(params))[2:4].sum(axis=0) * 0.5


class SixDigits(Format):
    def went(self, params):
        return [float(f"{p:.5g}") for p in params]


class SwapsTangential(Format):
    def came(self, params):
        params[[6, 7]] = params[[7, 6]]
        return params


class DropsSize(Format):
    def read(self, path):
        return {
            name: replace(i, camera=replace(i.camera, image_size=(640, 480))) for name, i in super().read(path).items()
        }


class OtherProjection(Format):
    def read(self, path):
        def moved(imported):
            return replace(imported, project=lambda points: imported.camera.project(points) + 0.5)

        return {name: moved(imported) for name, imported in super().read(path).items()}


class RecognisesAll(Format):
    def recognises(self, path):
        return True


class RecognisesNothing(Format):
    def recognises(self, path):
        return False


class RecognisesRudely(Format):
    def recognises(self, path):
        return path.read_bytes().startswith(b'{"small": 1')


class ReadsRudely(Format):
    def read(self, path):
        text = json.loads(path.read_text())
        return {name: as_imported(name, m, np.array(p), tuple(s)) for name, m, p, s in text["cameras"]}


class WritesAnything(Format):
    def write(self, cameras, path):
        pinholes = {n: Camera(n, "opencv4", np.resize(c.params, 8), c.image_size) for n, c in cameras.items()}
        super().write(pinholes or {"none": Camera("none", "opencv4", np.ones(8), (1, 1))}, path)


class LeavesAHalf(Format):
    def write(self, cameras, path):
        path.write_text("{")
        super().write(cameras, path)


class LastOneWins(Format):
    def write(self, cameras, path):
        super().write(dict(list(cameras.items())[-1:]), path)


class BackToFront(Format):
    def read(self, path):
        return dict(reversed(super().read(path).items()))


class WithoutADot(Format):
    extensions = ("small",)


class DoesNothing(Format):
    reads = writes = False


FORMAT_LIES = [
    (CornerOrigin, "reads_what_it_writes"),
    (SixDigits, "reads_what_it_writes"),
    (SwapsTangential, "reads_what_it_writes"),
    (DropsSize, "reads_what_it_writes"),
    (OtherProjection, "reads_what_it_writes"),
    (RecognisesNothing, "reads_what_it_writes"),
    (RecognisesAll, "recognises_only_its_own"),
    (RecognisesRudely, "recognises_only_its_own"),
    (ReadsRudely, "refuses_damaged_files"),
    (WritesAnything, "refuses_what_it_does_not_carry"),
    (LeavesAHalf, "refuses_what_it_does_not_carry"),
    (LastOneWins, "keeps_cameras_apart"),
    (BackToFront, "keeps_cameras_apart"),
    (WithoutADot, "says_what_it_carries"),
    (DoesNothing, "says_what_it_carries"),
]


@pytest.mark.parametrize(("liar", "check"), FORMAT_LIES, ids=lambda value: getattr(value, "__name__", value))
def test_a_lying_format_is_caught(liar, check):
    assert caught(liar(), check)


class BothWaysWrong(CornerOrigin):
    """Half a pixel off when writing, and again, the other way, when reading: only another program's file shows it."""

    def came(self, params):
        return params - np.eye(len(params))[2:4].sum(axis=0) * 0.5


def test_half_a_pixel_wrong_both_ways_is_caught_by_a_sample(tmp_path: Path):
    truth = Camera("cam", "opencv4", np.array([700.0, 701.0, 320.0, 240.0, 0.1, 0.0, 0.0, 0.0]), (640, 480))
    Format().write({"cam": truth}, tmp_path / "theirs.small")
    samples = {tmp_path / "theirs.small": {"cam": truth}}
    for check in checks_of(BothWaysWrong()):
        check(BothWaysWrong())
    assert "half a pixel" in caught(BothWaysWrong(), "reads_other_programs_files", samples=samples)


@parametrize_checks(Format())
def test_without_a_lie_the_format_conforms(provided, check):
    check(provided)
