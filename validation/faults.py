"""Thousands of faults, and what was lost or wrong after each.

Claim
    After damaged files, failing disks, odd names, writers at the same time and commands stopped at any moment, no
    result is lost and none is wrong; otherwise the run ends with 1.

Way
    The faults of ``tests/faults.py``, with 500 damaged files of each kind (or as many as the argument says); the
    commands themselves, stopped by SIGTERM and SIGKILL at random moments; and writing to a disk (a tmpfs, where that
    may be mounted) that is full.

Run ``python validation/bench.py faults``.
"""

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

import numpy as np
from faults import FAULTS, NAMES, SEALED, STEPS, damaged, failing, kinds, many_writers, odd_name, on_a_small_disk
from worlds import SmallWorld

from opencsp_calib import Camera
from opencsp_calib.hdf5_calibration import load_observations

COMMAND = [sys.executable, "-m", "opencsp_calib"]
STOPPED = (1, 143, -signal.SIGTERM, -signal.SIGKILL)  # said so, or ended before there was anything to say
TO_WRITE = ("camera", "observations", "calibration", "opencv", "colmap-bin", "image", "drawing pdf")


def main() -> None:
    """Run all cases, and print the table."""
    cases = int(sys.argv[1]) if len(sys.argv) > 1 else 500
    folder = Path(tempfile.mkdtemp(prefix="faults-"))
    known = {kind.name: kind for kind in kinds()}
    aside = [kind for kind in known.values() if kind.name != "journal"]

    def fresh() -> Path:
        return Path(tempfile.mkdtemp(dir=folder))

    def each(function: Callable[..., str], *chosen: tuple) -> Iterator[str]:
        for arguments in chosen:
            place = fresh()
            yield function(arguments[0], place, *arguments[1:])
            shutil.rmtree(place)

    here = {name: fresh() for name in SEALED}
    groups = {
        "bytes changed, ends cut off": (damaged(known[n], here[n], seed) for n in SEALED for seed in range(cases)),
        "a step of writing fails, or is stopped": each(
            failing, *((kind, step, fault) for kind in aside for step in STEPS for fault in FAULTS)
        ),
        "the system allows no more bytes": each(
            on_a_small_disk, *((k, n) for k in aside for n in (0, 1, 60, 900, 4000))
        ),
        "odd names": each(odd_name, *((kind, name) for kind in known.values() for name in NAMES)),
        "two writers and a reader of one file": (
            found for name in ("camera", "opencv", "board file") for found in many_writers(known[name], fresh(), 100)
        ),
        "a full disk (tmpfs of 64 KiB)": _full_disk(folder, [known[name] for name in TO_WRITE]),
        "commands stopped by SIGTERM and SIGKILL": _stopped(fresh(), 60),
    }
    print("| fault | cases | lost or wrong |\n|---|---|---|")
    total, wrong = 0, []
    for name, outcomes in groups.items():
        found = list(outcomes)
        bad = [outcome for outcome in found if outcome]
        total, wrong = total + len(found), wrong + bad
        print(f"| {name} | {len(found)} | {len(bad)} |", flush=True)
    print(f"| all | {total} | {len(wrong)} |")
    for outcome in wrong:
        print(f"- {outcome}")
    shutil.rmtree(folder)
    sys.exit(bool(wrong))


def _full_disk(folder: Path, chosen: list) -> Iterator[str]:
    """What was there stays, and there is one line, when the disk has no room for the new file."""
    disk = folder / "disk"
    disk.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "none", disk], check=False).returncode:
        return
    try:
        for kind in chosen:
            kind.write(disk / kind.file, 0)
            before = (disk / kind.file).read_bytes()
            for room in (0, 4096):
                (disk / "filler").write_bytes(b"")
                free = os.statvfs(disk)
                (disk / "filler").write_bytes(bytes(max(0, free.f_bavail * free.f_frsize - room)))
                failed = ""
                try:
                    kind.write(disk / kind.file, 1)
                except Exception as error:
                    failed = str(error)
                now = (disk / kind.file).read_bytes()
                left = {path.name for path in disk.iterdir()} - {kind.file, "filler"}
                right = not left and ((now == before) == bool(failed)) and ("No space" in failed or not failed)
                yield "" if right else f"{kind.name} with {room} bytes of room: {failed or 'no error'}, {left}"
                before = now
            for path in disk.iterdir():
                path.unlink()
    finally:
        subprocess.run(["umount", disk], check=True)


def _stopped(folder: Path, times: int) -> Iterator[str]:
    """The camera there was before is there, or the new one; SIGTERM leaves nothing half-written and says one line."""
    chance = np.random.default_rng(1)
    world, photographs, out = SmallWorld.seeded(), folder / "photographs", folder / "out"
    photographs.mkdir()
    world.photograph(photographs)
    started = time.monotonic()
    plain = [*COMMAND, "calibrate", str(photographs), "--board", world.spec, "--solver", "opencv"]
    subprocess.run([*plain, "-o", str(folder / "new.h5")], check=True, stderr=subprocess.DEVNULL)
    whole_s = time.monotonic() - started
    cameras = (world.camera, Camera.load(folder / "new.h5"))
    for number in range(times):
        shutil.rmtree(out, ignore_errors=True)
        out.mkdir()
        world.camera.save(out / "camera.h5")
        how = signal.SIGKILL if number % 3 == 2 else signal.SIGTERM
        run = subprocess.Popen([*plain, "-o", str(out / "camera.h5")], stderr=subprocess.PIPE, text=True)
        time.sleep(chance.uniform(0.02, 1.1) * whole_s)
        run.send_signal(how)
        said = run.communicate()[1].strip().splitlines()
        yield _judged(number, how, run.returncode, said, out, cameras)


def _judged(number: int, how: int, code: int, said: list[str], out: Path, cameras: tuple[Camera, Camera]) -> str:
    what = f"signal {how}, case {number}"
    if Camera.load(out / "camera.h5") not in cameras:
        return f"{what}: another camera"
    if code == 0 and how == signal.SIGTERM and load_observations(out / "camera.h5"):
        return ""  # it had just finished
    if code not in (0, *STOPPED):
        return f"{what}: exit code {code}, {said}"
    if any("Traceback" in line for line in said):
        return f"{what}: {said[-1]}"
    left = {path.name for path in out.iterdir()} - {"camera.h5", "camera.h5.journal"}
    if how == signal.SIGTERM and (left or (code == 1 and not said[-1].startswith("error: stopped"))):
        return f"{what}: {left} left, {said}"
    return ""


if __name__ == "__main__":
    main()
