"""What the SDK says, in one sentence for a person."""

from typing import Any

__all__ = ["busy", "is_busy", "sentence"]

BUSY = ("exclusively opened", "controlled by another application", "0xe1018006", "access denied")


def sentence(error: Exception) -> str:
    """The SDK's message without the place in its source code."""
    text = str(error).split(" : ")[0].splitlines()
    return text[0].strip().rstrip(".") if text else repr(error)


def is_busy(error: Exception, accessibility: Any = None) -> bool:
    """Whether a camera could not be opened because somebody has it, by the SDK's message or its look at the camera."""
    from pypylon import pylon

    held = (pylon.Accessibility_Opened, pylon.Accessibility_OpenedExclusively)
    return any(words in str(error).lower() for words in BUSY) or accessibility in held


def busy(serial: str) -> str:
    """The sentence for a camera that another program has."""
    return (
        f"the camera {serial} is in use by another program: close it (pylon Viewer, or a capture that still runs) and "
        "try again"
    )
