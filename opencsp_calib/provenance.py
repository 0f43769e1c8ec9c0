"""What a result was made with, and when: kept with it, and passed over where two results are compared."""

import platform
from datetime import datetime, timezone
from importlib.metadata import version

__all__ = ["made_with"]


def made_with() -> dict[str, str]:
    """Versions, platform, and the time now."""
    return {
        "opencsp-calib": version("opencsp-calib"),
        "python": platform.python_version(),
        "numpy": version("numpy"),
        "platform": platform.platform(),
        "time": datetime.now(timezone.utc).isoformat(timespec="seconds"),
    }
