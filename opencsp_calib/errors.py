"""Every error that opencsp-calib raises on purpose.

::

    CalibError                       catch this to catch them all
    ├── InputError                   bad use or bad input; the command line exits with 2
    │   ├── FileFormatError          a file is damaged, hostile, or not what it claims to be
    │   ├── BoardSpecError           a board description that cannot be understood
    │   ├── NotExactError            an imported camera is not exactly one of our lens models
    │   ├── MissingDependencyError   something must be installed first; says what
    │   └── PluginError              two plugins of one name, or no plugin of that name
    └── CalibrationFailedError       the input was fine, the calibration was not; exits with 1
        └── CancelledError           somebody stopped it; nothing was written

The message is one line for the person at the keyboard: what is wrong, where, and what to do about it.
"""

__all__ = [
    "BoardSpecError",
    "CalibError",
    "CalibrationFailedError",
    "CancelledError",
    "FileFormatError",
    "InputError",
    "MissingDependencyError",
    "NotExactError",
    "PluginError",
    "PluginWarning",
]


class CalibError(Exception):
    """Anything that opencsp-calib raises on purpose; its message is one line for a person."""

    exit_code = 2


class InputError(CalibError):
    """Bad use or bad input."""


class FileFormatError(InputError):
    """A file is damaged, hostile, or not what it claims to be."""


class BoardSpecError(InputError):
    """A board description that cannot be understood."""


class NotExactError(InputError):
    """An imported camera is not exactly one of our lens models."""


class MissingDependencyError(InputError):
    """Something must be installed first; the message says what."""


class PluginError(InputError):
    """Two plugins of one name, or no plugin of the name asked for."""


class CalibrationFailedError(CalibError):
    """The input could be read, but no calibration that can be trusted came out of it."""

    exit_code = 1


class CancelledError(CalibrationFailedError):
    """Somebody stopped the work; nothing was written."""


class PluginWarning(UserWarning):
    """A plugin could not be loaded and was left out."""
