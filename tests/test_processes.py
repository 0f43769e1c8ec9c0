"""Processes of our own: what becomes of them when the program that started them is told to stop."""

import subprocess
import sys

import pytest

from opencsp_calib.processes import APART

CTRL_C_AT_ONCE = """
import os, signal, subprocess, sys
from opencsp_calib.processes import APART, own_process

signal.signal(signal.SIGINT, lambda *_: None)
command = own_process("opencsp_calib.gui.jobs")
started = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, **APART)
os.killpg(0, signal.SIGINT)  # as a terminal does
started.communicate(b"")
sys.exit(started.returncode)
"""


@pytest.mark.skipif(not APART, reason="no groups of processes here, or Python before 3.11 cannot start one")
def test_ctrl_c_is_for_the_process_that_started_it_from_the_first_moment_on() -> None:
    command = [sys.executable, "-c", CTRL_C_AT_ONCE]
    done = subprocess.run(command, capture_output=True, text=True, start_new_session=True)
    assert (done.returncode, done.stderr) == (0, "")
