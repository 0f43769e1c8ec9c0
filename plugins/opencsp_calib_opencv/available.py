"""Whether a usable OpenCV is installed here, without loading it."""

import re
from importlib.machinery import PathFinder
from pathlib import Path

__all__ = ["missing_opencv"]

OLDEST = (4, 9)


def missing_opencv() -> str | None:
    """One sentence naming what to install when there is no ``cv2`` from 4.9 on; None when there is."""
    install = "pip install 'opencsp-calib[opencv]'"
    found = PathFinder.find_spec("cv2")  # not what is loaded: half of it, where another thread is about to load it
    if found is None:
        return f"it needs OpenCV: {install} (any package with cv2 from 4.9 on serves)"
    version = _version([Path(folder) for folder in found.submodule_search_locations or ()])
    if version is not None and version < OLDEST:
        return f"it needs OpenCV 4.9 or newer, and {version[0]}.{version[1]} is installed: {install} --upgrade"
    return None


def _version(folders: list[Path]) -> tuple[int, int] | None:
    """As pip's packages record it; None where a distribution's own build does not."""
    for folder in folders:
        if (folder / "version.py").is_file():
            text = (folder / "version.py").read_text(encoding="utf-8")
            match = re.search(r'opencv_version\s*=\s*"(\d+)\.(\d+)', text)
            if match:
                return int(match[1]), int(match[2])
    return None
