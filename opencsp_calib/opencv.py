"""OpenCV where it is installed, and how many threads it may use.

Any cv2 serves, whichever of its four packages it came with: OpenCSP's environment has one that must not be replaced.
"""

from contextlib import AbstractContextManager
from typing import Any

from opencsp_calib.errors import MissingDependencyError
from opencsp_calib.process_setting import ProcessSetting, Restore

__all__ = ["opencv", "opencv_on_one_thread", "opencv_version"]


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


def opencv_on_one_thread() -> AbstractContextManager[None]:
    """OpenCV's own threads off, in the whole process, so that they do not fight ours over the cores; then as before."""
    return _one_thread.changed()


def _change() -> Restore:
    cv2 = opencv()
    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    return lambda: cv2.setNumThreads(before)


_one_thread = ProcessSetting(_change)
