"""Detection on a real Dask cluster, started here on loopback: the same to the last bit, whatever happens to workers."""

import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from command_line import answer
from observed import assert_same
from worlds import SmallWorld

from opencsp_calib import InputError, Observations, View, detect
from opencsp_calib.cli import run
from opencsp_calib.cluster import Cluster
from opencsp_calib.errors import CancelledError
from opencsp_calib.hdf5_calibration import load_observations
from opencsp_calib.images import EncodedImage, find_images, read_encoded, read_image, write_image
from opencsp_calib.looking import Search
from opencsp_calib.registry import installed

distributed = pytest.importorskip("distributed", reason="pip install 'opencsp-calib[dask]'")
dask = pytest.importorskip("dask", reason="pip install 'opencsp-calib[dask]'")

WAIT_S = 240  # for a busy machine; nothing waits longer than it must


@contextmanager
def started(*arguments: str, folder: Path, environment: dict[str, str] | None = None) -> Iterator[subprocess.Popen]:
    """One of Dask's own programs, ended when the block ends; what it says goes to a file."""
    log = folder / f"{time.monotonic_ns()}.log"
    with log.open("w") as sink:
        process = subprocess.Popen(
            [sys.executable, "-m", "distributed.cli." + arguments[0], *arguments[1:]],
            stdout=sink,
            stderr=sink,
            cwd=folder,
            env={**os.environ, **(environment or {})},
        )
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def address_in(place: Path) -> str:
    """Of the scheduler that writes it there; it may be half written when it is read."""
    until = time.monotonic() + WAIT_S
    while True:
        try:
            return json.loads(place.read_text())["address"]
        except (FileNotFoundError, ValueError):
            if time.monotonic() > until:
                raise
        time.sleep(0.05)


@contextmanager
def cluster(folder: Path, workers: int, protocol: str = "tcp", environment: dict[str, str] | None = None):
    """A scheduler and workers on loopback: its address, and their processes."""
    place = folder / "scheduler.json"
    scheduler = ("dask_scheduler", "--host", f"{protocol}://127.0.0.1", "--port", "0", "--no-dashboard", "--no-show")
    worker = ("dask_worker", "--scheduler-file", str(place), "--host", "127.0.0.1", "--nthreads", "1")
    worker += ("--no-dashboard", "--no-nanny", "--death-timeout", str(WAIT_S), "--local-directory", str(folder))
    with started(*scheduler, "--scheduler-file", str(place), folder=folder, environment=environment):
        address = address_in(place)
        with ExitStack() as stack:
            processes = [
                stack.enter_context(started(*worker, folder=folder, environment=environment)) for _ in range(workers)
            ]
            yield address, processes


def in_this_process() -> "distributed.Client":
    """A cluster in this very process."""
    own = {"host": "127.0.0.1", "protocol": "tcp", "dashboard_address": "127.0.0.1:0"}
    return distributed.Client(processes=False, n_workers=1, threads_per_worker=2, **own)


@pytest.fixture(scope="module")
def folder(small_world: SmallWorld, photographs: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two hundred images: the twelve photographs again and again, each with a pixel of its own, and a broken file."""
    folder = tmp_path_factory.mktemp("two hundred")
    files = find_images(photographs)
    for index in range(199):
        pixels = read_image(files[index % len(files)]).pixels.copy()
        pixels[0, 0] = index
        write_image(pixels, folder / f"{index:03d}.png")
    (folder / "broken.png").write_bytes(b"\x89PNG, but no more")
    return folder


@pytest.fixture(scope="module")
def local(small_world: SmallWorld, folder: Path) -> Observations:
    return detect(folder, small_world.board)


def test_a_worker_killed_in_the_middle(
    small_world: SmallWorld, folder: Path, local: Observations, tmp_path: Path
) -> None:
    """Two workers, one killed without warning after a fifth of the images: the same result."""
    with cluster(tmp_path, workers=2) as (address, workers), distributed.Client(address) as client:
        client.wait_for_workers(2, timeout=WAIT_S)

        def progress(done: int, total: int, view: View) -> None:
            if done == total // 5:
                os.kill(workers[0].pid, getattr(signal, "SIGKILL", signal.SIGTERM))

        found = detect(folder, small_world.board, scheduler=client, progress=progress)
        assert workers[0].wait(WAIT_S) != 0
        assert_same(found, local)
        assert client.status == "running"  # a client that was given is not closed


def test_the_command_line_sends_what_workers_cannot_see(
    small_world: SmallWorld, folder: Path, local: Observations, tmp_path: Path
) -> None:
    """Over TLS, with certificates from Dask's configuration; relative names, which mean nothing to a worker."""
    environment = certificates(tmp_path)
    output = tmp_path / "seen.h5"
    with cluster(tmp_path, workers=1, protocol="tls", environment=environment) as (address, _):
        assert address.startswith("tls://")
        names = [f"{index:03d}.png" for index in range(12)]
        command = [sys.executable, "-m", "opencsp_calib", "detect", *names, "--board", SmallWorld.spec]
        command += ["-o", str(output), "--scheduler", address]
        subprocess.run(command, cwd=folder, env={**os.environ, **environment}, check=True)
    found = load_observations(output)
    wanted = tuple(view for view in local.views if view.image in names)
    assert_same(found, replace(local, views=wanted))


def test_images_that_a_worker_does_not_see_are_sent(small_world: SmallWorld, photographs: Path) -> None:
    """A file that has changed since it was read is not the same file either."""
    search = Search(small_world.board, installed().detector("checkerboard"), "model")
    here = read_encoded(find_images(photographs)[0])
    elsewhere = replace(here, file=replace(here.file, path=Path("/nowhere/01.png")))
    changed = EncodedImage(find_images(photographs)[1], here.data, here.sha256)
    with in_this_process() as client:
        for encoded in (here, elsewhere, changed):
            found = Cluster(client, search, threading.Event()).look(encoded).view
            expected = search.look(encoded).view
            assert_same(*(Observations(small_world.board, (640, 480), (view,)) for view in (found, expected)))


def test_it_can_be_stopped(small_world: SmallWorld, folder: Path) -> None:
    stop = threading.Event()
    with in_this_process() as client, pytest.raises(CancelledError, match="stopped after"):
        detect(folder, small_world.board, scheduler=client, stop=stop, progress=lambda *_: stop.set())


def test_workers_with_other_software_are_refused(small_world: SmallWorld, photographs: Path) -> None:
    with in_this_process() as client:
        search = Search(small_world.board, installed().detector("checkerboard"), "model")
        ours = Cluster(client, search, threading.Event())
        ours._kind = (*ours._kind[:3], {**ours._kind[3], "opencv": "1.0"})
        with pytest.raises(InputError, match=r"instead of 1\.0: install the same"):
            ours.look(read_encoded(find_images(photographs)[0]))


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense", "tls://127.0.0.1:9", "magic://x"])
def test_a_scheduler_that_is_not_there(
    photographs: Path, address: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    output = tmp_path / "seen.h5"
    with dask.config.set({"distributed.comm.timeouts.connect": "2s"}):
        command = ["detect", str(photographs), "--board", SmallWorld.spec, "-o", str(output), "--scheduler", address]
        assert run(command) == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert said[-1].startswith(f"error: cannot use the Dask scheduler '{address}'")
    assert list(tmp_path.iterdir()) == []


def test_a_fleet_without_its_scheduler_is_not_begun(tmp_path: Path, capsys) -> None:
    """One line for the address, not a failure for every camera."""
    for name in ("north", "south"):
        (tmp_path / "cameras" / name).mkdir(parents=True)
        (tmp_path / "cameras" / name / "1.png").write_bytes(b"never read")
    command = ["fleet", str(tmp_path / "cameras"), "--board", SmallWorld.spec, "-o", str(tmp_path / "results")]
    assert run([*command, "--scheduler", "nonsense"]) == 2
    assert capsys.readouterr().err.startswith("error: cannot use the Dask scheduler 'nonsense'")
    assert [path.name for path in tmp_path.iterdir()] == ["cameras"]


def test_a_fleet_on_a_cluster(photographs: Path, tmp_path: Path, capsys) -> None:
    for name in ("north", "south"):
        shutil.copytree(photographs, tmp_path / "cameras" / name)
    with in_this_process() as client:
        at = client.scheduler.address
        found = answer(capsys, "fleet", tmp_path / "cameras", "--board", SmallWorld.spec, "--scheduler", at)
    assert [camera["verdict"] for camera in found["cameras"]] == ["good", "good"]


def certificates(folder: Path) -> dict[str, str]:
    """A certificate for 127.0.0.1 that is its own authority, as Dask's configuration in the environment names it."""
    key, certificate = folder / "key.pem", folder / "certificate.pem"
    command = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=loopback"]
    command += ["-addext", "subjectAltName=IP:127.0.0.1", "-keyout", str(key), "-out", str(certificate)]
    try:
        subprocess.run(command, check=True, capture_output=True)
    except FileNotFoundError:
        pytest.skip("openssl is not here to make certificates")
    tls = "DASK_DISTRIBUTED__COMM__TLS__"
    files = {f"{tls}CA_FILE": str(certificate)}
    for role in ("SCHEDULER", "WORKER", "CLIENT"):
        files |= {f"{tls}{role}__CERT": str(certificate), f"{tls}{role}__KEY": str(key)}
    return {**files, "DASK_DISTRIBUTED__COMM__REQUIRE_ENCRYPTION": "True"}
