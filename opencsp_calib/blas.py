"""How many threads the BLAS library below NumPy may use.

Its threads wait for each other at every block of a matrix. Where other threads or another program have one of the
cores, that makes the matrices of a calibration ten to a hundred times slower; on idle cores they hardly gain by them.
"""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

__all__ = ["blas_on_one_thread"]

_lock = threading.Lock()
_inside: list[Any] = []  # one limit for each of those now inside; only the first one's is of use


@contextmanager
def blas_on_one_thread() -> Iterator[None]:
    """BLAS on one thread, then as before.

    The setting is one for the whole process: where several are inside at once, the last to leave restores it.
    """
    from threadpoolctl import threadpool_limits

    with _lock:
        _inside.append(threadpool_limits(limits=1, user_api="blas") if not _inside else _inside[0])
    try:
        yield
    finally:
        with _lock:
            limit = _inside.pop()
            if not _inside:
                limit.restore_original_limits()
