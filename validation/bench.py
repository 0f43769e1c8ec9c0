"""Run studies, and keep what they found in ``validation/results/``.

``python validation/bench.py`` runs all, ``python validation/bench.py corners bundle_speed`` those. A study is a script
here whose docstring has a title, what it claims, and its way, and which prints its figures. Its result is a page:
title, claim, way and whatever a person wrote below them stay; what follows the line ``## Figures`` is replaced.
"""

import os
import platform
import re
import subprocess
import sys
import time
from datetime import datetime, timezone
from pathlib import Path

from opencsp_calib.atomic import replacing

HERE = Path(__file__).resolve().parent
RESULTS = HERE / "results"
FIGURES = "## Figures\n"


def studies() -> dict[str, Path]:
    """All of them, by name."""
    return {path.stem: path for path in sorted(HERE.glob("[a-z]*.py")) if path != Path(__file__).resolve()}


def head_of(study: Path) -> str:
    """Title, claim and way, from the docstring."""
    text = re.match(r'"""(.*?)"""', study.read_text(encoding="utf-8"), re.DOTALL)[1]
    title = text.partition("\n")[0].rstrip(".")
    parts = [f"# {title}", *(f"**{word}.** {_section(text, word)}" for word in ("Claim", "Way"))]
    return "\n\n".join([*parts, f"**Run.** `python validation/bench.py {study.stem}`"]) + "\n\n"


def _section(text: str, word: str) -> str:
    found = re.search(rf"^{word}s?\n(.*?)(?=\n\n|\Z)", text, re.DOTALL | re.MULTILINE)
    if not found:
        raise ValueError(f"the docstring has no {word!r}: {text[:60]!r}")
    return "\n".join(line.strip() for line in found[1].strip().splitlines())


def machine() -> str:
    """When and on what."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    load = f", load {os.getloadavg()[0]:.1f} before" if hasattr(os, "getloadavg") else ""
    now = datetime.now(timezone.utc)
    return f"{now:%Y-%m-%d}, {processor()}, {cores} cores{load}, Python {platform.python_version()}"


def processor() -> str:
    """Its name."""
    info = Path("/proc/cpuinfo")
    names = re.findall(r"^model name\s*: (.*)$", info.read_text(), re.MULTILINE) if info.is_file() else []
    return names[0] if names else platform.processor() or platform.machine()


def run(study: Path) -> bool:
    """Run one; keep what it found if it ended well."""
    print(f"== {study.stem}", file=sys.stderr, flush=True)
    where, started = machine(), time.perf_counter()
    done = subprocess.run([sys.executable, study], stdout=subprocess.PIPE, text=True)
    if done.returncode:
        return False
    page = RESULTS / f"{study.stem}.md"
    head = page.read_text(encoding="utf-8").partition(FIGURES)[0] if page.exists() else head_of(study)
    took = f"{time.perf_counter() - started:.0f} s"
    with replacing(page) as temporary:
        temporary.write_text(f"{head}{FIGURES}\n{where}; took {took}.\n\n{done.stdout.strip()}\n", encoding="utf-8")
    return True


def main() -> None:
    """Run those named, or all; end with an error where one failed."""
    known = studies()
    chosen = sys.argv[1:] or list(known)
    unknown = sorted(set(chosen) - set(known))
    if unknown:
        sys.exit(f"there is no study {', '.join(unknown)}; there are {', '.join(known)}")
    failed = [name for name in chosen if not run(known[name])]
    if failed:
        sys.exit(f"failed: {', '.join(failed)}")


if __name__ == "__main__":
    main()
