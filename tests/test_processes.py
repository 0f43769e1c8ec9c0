"""Processes of our own."""

import os
import subprocess
import sys
from pathlib import Path

import pytest


@pytest.mark.skipif(sys.platform == "win32", reason="there the system is told beside the command")
def test_work_in_the_background_steps_behind_what_people_look_at() -> None:
    """In a session of its own, because Linux weighs those first: else a browser would get no more than the work."""
    asked = "import os; from opencsp_calib.processes import step_back; step_back(); "
    told = "print(os.getsid(0) == os.getpid(), os.nice(0), open('/proc/self/autogroup').read())"
    if not Path("/proc/self/autogroup").exists():
        told = "print(os.getsid(0) == os.getpid(), os.nice(0))"
    done = subprocess.run([sys.executable, "-c", asked + told], check=True, capture_output=True, text=True)
    own, nice, *weight = done.stdout.split()
    assert (own, int(nice)) == ("True", min(19, os.nice(0) + 10))
    assert weight[1:] in ([], ["nice", "10"])
