"""What a command takes in a process of its own: time by the clock, processor time, and peak memory. Linux only."""

import os
import re
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Run:
    """What one run of a command took."""

    wall_s: float
    cpu_s: float
    peak_mb: float

    @classmethod
    def of(cls, command: list[str]) -> "Run":
        """Run it; RuntimeError where it fails."""
        started = time.perf_counter()
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        peak_mb, ended = 0.0, 0
        while not ended:
            peak_mb = max(peak_mb, _peak_mb(process.pid))
            time.sleep(0.01)
            ended, status, usage = os.wait4(process.pid, os.WNOHANG)
        if status:
            raise RuntimeError(f"failed: {command}")
        return cls(time.perf_counter() - started, usage.ru_utime + usage.ru_stime, peak_mb)


def _peak_mb(pid: int) -> float:
    """Of a running process. Its `ru_maxrss` is no use: it begins with that of the process that started it."""
    found = re.search(r"VmHWM:\s+(\d+) kB", Path(f"/proc/{pid}/status").read_text(encoding="ascii"))
    return int(found[1]) / 1024 if found else 0.0
