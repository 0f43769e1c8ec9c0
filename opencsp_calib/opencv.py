"""OpenCV where it is installed, and how many threads it may use.

Any cv2 serves, whichever of its four packages it came with: OpenCSP's environment has one that must not be replaced.
"""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from opencsp_calib.errors import MissingDependencyError

__all__ = ["opencv", "opencv_on_one_thread", "opencv_version"]

_lock = threading.Lock()
_before: list[int] = []  # OpenCV's number of threads, as each of those now inside `opencv_on_one_thread` found it


def opencv() -> Any:
    """The module cv2.

    Raises
    ------
    MissingDependencyError
        If there is none.
    """
    try:
        import cv2
    except ImportError as error:
        message = f"OpenCV cannot be imported ({error}); pip install 'opencsp-calib[opencv]'"
        raise MissingDependencyError(message) from None
    return cv2


def opencv_version() -> str:
    """Such as ``5.0.0``."""
    return str(opencv().__version__)


@contextmanager
def opencv_on_one_thread() -> Iterator[None]:
    """OpenCV's own threads off while ours are at work, so that they do not fight over the cores; then as before.

    The setting is one for the whole process: where several are inside at once, the last to leave restores it.
    """
    cv2 = opencv()
    with _lock:
        _before.append(cv2.getNumThreads())
        cv2.setNumThreads(1)
    try:
        yield
    finally:
        with _lock:
            if len(_before) == 1:
                cv2.setNumThreads(_before[0])
            _before.pop()
