"""Whether a usable OpenCV is installed here, without loading it."""

from importlib.util import find_spec

__all__ = ["missing_opencv"]


def missing_opencv() -> str | None:
    """One sentence naming what to install when there is no ``cv2``; None when there is."""
    if find_spec("cv2") is None:
        return "it needs OpenCV: pip install 'opencsp-calib[opencv]' (any opencv package from 4.9 on serves)"
    return None
