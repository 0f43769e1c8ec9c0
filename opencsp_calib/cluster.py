"""Looking at images on a Dask cluster: the workers do what threads do here, and find the same to the last bit.

Dask's messages are pickles: whoever can send to a scheduler or worker can run code there and here. So use only a
cluster that you trust, over ``tls://`` where others share the network. Scheduling, and doing again what a lost worker
had not finished, is Dask's.
"""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from socket import gethostname
from typing import TYPE_CHECKING, Any, TypeAlias

from opencsp_calib.blas import blas_on_one_thread
from opencsp_calib.board import Board
from opencsp_calib.errors import CancelledError, InputError, MissingDependencyError
from opencsp_calib.images import EncodedImage, ImageFile, read_encoded
from opencsp_calib.looking import Look, Refine, Search, engine_versions
from opencsp_calib.opencv import opencv_on_one_thread
from opencsp_calib.registry import installed

if TYPE_CHECKING:
    from distributed import Client

__all__ = ["Cluster", "Scheduler", "client_of", "connected"]

Scheduler: TypeAlias = "str | Client"
Kind: TypeAlias = "tuple[Board, str, Refine, dict[str, str]]"

MIN_IN_FLIGHT = 32  # so that workers that come later find something to do
POLL_S = 0.2
LARGEST_MESSAGE = "4 GiB"  # one image; above 10 MB Dask would warn that it is large


class Cluster:
    """A Dask cluster that looks for a board in images.

    Parameters
    ----------
    client : distributed.Client
    search : Search
    ended : threading.Event
        When it is set, nobody waits any longer.
    """

    def __init__(self, client: "Client", search: Search, ended: threading.Event) -> None:
        self._client = client
        self._kind: Kind = (search.board, search.detector.name, search.refine, engine_versions())
        self._ended = ended
        self._storage_is_shared = True  # until a worker does not see a file

    @property
    def in_flight(self) -> int:
        """How many images to have under way: each worker's threads at work, and as many waiting."""
        threads: int = sum(self._client.nthreads().values())
        return max(MIN_IN_FLIGHT, 2 * threads)

    def look(self, encoded: EncodedImage) -> Look:
        """What a worker finds in an image, which it reads itself where it sees the same file, and else is sent.

        Raises
        ------
        InputError
            If a worker has not the same software as this machine.
        CancelledError
            If the cluster was lost, or `ended` is set.
        """
        if self._storage_is_shared:
            look = self._answer(replace(encoded, data=b""))
            if look is not None:
                return look
            self._storage_is_shared = False
        look = self._answer(encoded)
        if look is None:
            raise CancelledError(f"no worker looked at {encoded.file.path}")
        return look

    def _answer(self, encoded: EncodedImage) -> Look | None:
        from distributed import KilledWorker

        place = str(encoded.file.path.absolute())
        future = self._client.submit(_look_there, self._kind, encoded, place, pure=False)
        done = threading.Event()
        future.add_done_callback(lambda _: done.set())
        try:
            while not done.wait(POLL_S):
                if self._ended.is_set():
                    raise CancelledError("stopped")
            answer: Look | None = future.result()
        except InputError:
            raise
        except KilledWorker:
            lost = f"{encoded.file.path} was tried on several workers, and each of them was lost"
            raise CancelledError(lost) from None
        except Exception as error:  # whatever Dask may throw, or a worker that lacks what it needs
            if self._ended.is_set():
                raise CancelledError("stopped") from None
            raise CancelledError(f"the Dask cluster failed: {error!r}") from None
        finally:
            future.cancel()
        return answer


@contextmanager
def connected(scheduler: Scheduler, search: Search, ended: threading.Event) -> Iterator[Cluster]:
    """A cluster to look for a board with; what is ours of the connection is closed in the end.

    Parameters
    ----------
    scheduler : str or distributed.Client
        See `client_of`.
    search : Search
    ended : threading.Event

    Raises
    ------
    InputError, MissingDependencyError
        See `client_of`.
    """
    with client_of(scheduler) as client:
        yield Cluster(client, search, ended)


@contextmanager
def client_of(scheduler: Scheduler) -> "Iterator[Client]":
    """A client of a scheduler that has workers; it is closed in the end, unless it was given.

    Parameters
    ----------
    scheduler : str or distributed.Client
        An address such as ``tcp://10.0.0.5:8786``, or a client. Certificates for ``tls://`` come from Dask's own
        configuration.

    Raises
    ------
    InputError
        If no scheduler answers there, or it has no workers.
    MissingDependencyError
        If Dask is not installed.
    """
    try:
        import dask
        from distributed import Client
    except ImportError as error:
        raise MissingDependencyError(f"Dask cannot be used ({error}); pip install 'opencsp-calib[dask]'") from None
    with dask.config.set({"distributed.admin.large-graph-warning-threshold": LARGEST_MESSAGE}):
        if not isinstance(scheduler, str):
            yield scheduler
            return
        client: Any = None
        try:
            client = Client(scheduler, set_as_default=False)
            client.wait_for_workers(1, timeout=dask.config.get("distributed.comm.timeouts.connect", "30s"))
        except Exception as error:  # a wrong address, nobody there, no certificate, no worker: Dask throws many kinds
            _close(client)
            raise InputError(f"cannot use the Dask scheduler {scheduler!r}: {_first_line(error)}") from None
        try:
            yield client
        finally:
            _close(client)


def _look_there(kind: Kind, encoded: EncodedImage, place: str) -> Look | None:
    """Run by a worker: what is in the image; None where it was not sent and no such file is seen from here."""
    board, detector, refine, versions = kind
    here = engine_versions()
    if here != versions:
        apart = sorted(name for name in {*here, *versions} if here.get(name) != versions.get(name))
        said = ", ".join(f"{name} {here.get(name)} instead of {versions.get(name)}" for name in apart)
        raise InputError(f"the Dask worker on {gethostname()} has {said}: install the same everywhere")
    if not encoded.data:
        try:
            seen = read_encoded(ImageFile(encoded.file.name, Path(place)))
        except InputError:
            return None
        if seen.sha256 != encoded.sha256:
            return None
        encoded = replace(encoded, data=seen.data)
    with opencv_on_one_thread(), blas_on_one_thread():  # a worker's threads are Dask's: one a core
        return Search(board, installed().detector(detector), refine).look(encoded)


def _close(client: Any) -> None:
    if client is not None:
        client.close()


def _first_line(error: Exception) -> str:
    return (str(error) or repr(error)).splitlines()[0]
