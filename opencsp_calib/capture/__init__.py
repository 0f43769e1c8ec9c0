"""Taking photographs for a calibration: from a source of images, at the right moments, into a folder, losing none.

::

    folder.py     the photographs on disk, each with its record; goes on where it was stopped
    release.py    when the shutter is released: by the coach, by a clock, by hand
    learner.py    has worked out in the background what the photographs tell, by
    learning.py   in a process of its own
    capture.py    puts these together: frame in, state out; the command line and the GUI show it
    running.py    from what a person asks for to a capture that runs
"""

from opencsp_calib.capture.capture import Capture, State
from opencsp_calib.capture.folder import CaptureFolder
from opencsp_calib.capture.release import Release, release_from
from opencsp_calib.capture.running import Prepared, prepared, settings_from

__all__ = [
    "Capture",
    "CaptureFolder",
    "Prepared",
    "Release",
    "State",
    "prepared",
    "release_from",
    "settings_from",
]
