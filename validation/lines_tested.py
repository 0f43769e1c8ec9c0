"""Lines of the core, and whether a test runs them.

Claim
    Tests run more than 95 % of the lines of the core (`opencsp_calib/`), and each line that none runs has an excuse.

Way
    All tests (or those named as arguments) with coverage.py, which also watches the processes that tests start: the
    window, its workers, the coach, command lines. Left out is the part in C, into which it cannot look; tests compare
    what it computes with truth. Lines that no test ran are listed with what stands in them; excuses are written by hand
    above the figures.

Run ``python validation/bench.py lines_tested``, or ``make coverage``.
"""

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LEAST_PERCENT = 95.0


def measured(tests: list[str]) -> dict:
    """What coverage.py found, as its JSON."""
    with tempfile.TemporaryDirectory(prefix="lines-tested-") as folder:
        report = Path(folder) / "lines.json"
        pytest = [sys.executable, "-m", "pytest", "-q", "-n", "2", "--dist", "worksteal"]
        done = subprocess.run(
            [*pytest, "--cov=opencsp_calib", f"--cov-report=json:{report}", *tests], cwd=ROOT, stdout=sys.stderr
        )
        if done.returncode:
            sys.exit("tests failed")
        return json.loads(report.read_text(encoding="utf-8"))


def runs_of(lines: list[int]) -> Iterator[tuple[int, int]]:
    """First and last of numbers that follow each other."""
    for _, run in groupby(enumerate(lines), key=lambda pair: pair[1] - pair[0]):
        numbers = [number for _, number in run]
        yield numbers[0], numbers[-1]


def main() -> None:
    """Print the share, and every line that was not run."""
    found = measured(sys.argv[1:])
    totals = found["totals"]
    percent = 100 * totals["covered_lines"] / totals["num_statements"]
    print(f"{percent:.2f} % of {totals['num_statements']} lines are run; {totals['missing_lines']} are not:\n")
    for name, file in sorted(found["files"].items()):
        if not file["missing_lines"]:
            continue
        source = (ROOT / name).read_text(encoding="utf-8").splitlines()
        print(f"- `{name}`")
        for first, last in runs_of(file["missing_lines"]):
            where = str(first) if first == last else f"{first}-{last}"
            print(f"  - {where}: `{source[first - 1].strip()}`")
    if percent < LEAST_PERCENT:
        sys.exit(f"fewer than {LEAST_PERCENT:g} % of the lines are run: {percent:.2f} %")


if __name__ == "__main__":
    main()
