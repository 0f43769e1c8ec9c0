"""Small changes to the code, and how many of them a test notices.

Claim
    Of the changes to lens models, corners, camera files and comparison that a random sample makes, the tests of that
    part alone notice more than 85 %.

Way
    mutmut's operators (another number, comparison, operator, word, argument) list every change in a function; a sample
    of 40 of each part (or as many as the argument says; seeded) is drawn, each is made alone in a copy of the project,
    and the tests of its part are run. A test that fails, and one that does not end in time, has noticed. mutmut's own
    runner is not used: it knows no parts. In C, which mutmut does not know, operators are exchanged and numbers made
    larger by one. Survivors are shown, those that make no difference included.

Run ``make mutants``, or ``python validation/mutants.py [NUMBER [PART ...]]``.
"""

import difflib
import os
import re
import runpy
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from mutmut.mutation.file_mutation import create_mutations, deep_replace
from scipy.stats import binomtest

ROOT = Path(__file__).resolve().parents[1]
EXCHANGED = {
    "+": "-", "-": "+", "*": "/", "/": "*", "+=": "-=", "-=": "+=", "<": "<=", ">": ">=", "<=": "<", ">=": ">",
    "&&": "||", "||": "&&", "==": "!=",
}  # fmt: skip
IN_C = re.compile(
    rf"(?<= )(?:{'|'.join(sorted(map(re.escape, EXCHANGED), key=len, reverse=True))})(?= )|(?<![\w.])\d+(?![\w]*\[)"
)
COPIED = ("opencsp_calib", "plugins", "tests", "docs", "native", "validation", "pyproject.toml", "README.md")
SEED = 20261128


@dataclass(frozen=True)
class Part:
    """Some files, and the tests that should notice a change to them."""

    name: str
    files: tuple[str, ...]
    tests: tuple[str, ...]


PARTS = (
    Part("models", ("models/*.py",), ("test_models", "test_camera")),
    Part(
        "corners",
        # not corner_table.py, which is the solvers'
        ("corners.py", *(f"corner_{what}.py" for what in ("fit", "grid", "judgement", "windows", "kernel"))),
        ("test_corner_grid", "test_corner_kernel", "test_corners_rejected", "test_corners", "test_corners_processed"),
    ),
    Part(
        "corners in C",
        ("../native/corner_*.c",),
        (
            *("test_native", "test_corner_kernel", "test_corner_steps"),
            *("test_corners_rejected", "test_corners", "test_corners_processed"),
        ),
    ),
    Part("hdf5", ("hdf5*.py",), ("test_hdf5", "test_hdf5_damage")),
    Part("comparison", ("comparison.py",), ("test_comparison",)),
)


@dataclass(frozen=True)
class Mutant:
    """A file with one change."""

    file: str
    before: str
    made: Callable[[], str]

    @cached_property
    def after(self) -> str:
        """What the file says with it."""
        return self.made()

    @property
    def change(self) -> str:
        """The lines changed, as people read them."""
        lines = difflib.unified_diff(self.before.splitlines(), self.after.splitlines(), n=0, lineterm="")
        removed_and_added = [line for line in lines if not line.startswith(("---", "+++"))]
        return "\n".join([self.file, *removed_and_added])


def mutants_of(part: Part) -> list[Mutant]:
    """Every change to its files."""
    found = []
    for pattern in part.files:
        for path in sorted((ROOT / "opencsp_calib").glob(pattern)):
            file, code = str(path.resolve().relative_to(ROOT)), path.read_text(encoding="utf-8")
            changes = changes_in_c(code) if path.suffix == ".c" else changes_in_python(file, code)
            found += [Mutant(file, code, change) for change in changes]
    return found


def changes_in_python(file: str, code: str) -> Iterator[Callable[[], str]]:
    """Mutmut's."""
    module, mutations, *_ = create_mutations(file, code)
    for mutation in mutations:
        if mutation.contained_by_top_level_function:
            yield lambda m=mutation: deep_replace(module, m.original_node, m.mutated_node).code


def changes_in_c(code: str) -> Iterator[Callable[[], str]]:
    """Another operator, or a number larger by one."""
    blanked = re.sub(r"/\*.*?\*/|^#.*?$", lambda found: " " * len(found[0]), code, flags=re.DOTALL | re.MULTILINE)
    for found in IN_C.finditer(blanked):
        changed = code[: found.start()] + (EXCHANGED.get(found[0]) or str(int(found[0]) + 1)) + code[found.end() :]
        yield lambda changed=changed: changed


def compiled(copy: Path) -> bool:
    """Whether the part in C can be, which is then done."""
    hook = runpy.run_path(str(copy / "native" / "build_hook.py"))["NativeLibraries"]
    try:
        hook(str(copy), {}, None, None, "", "wheel").initialize("", {"artifacts": []})
    except SystemExit:
        return False
    return True


def outcome(copy: Path, part: Part, timeout_s: float) -> str:
    """What the tests of the part do: "pass", "fail", or "hang"."""
    tests = [f"tests/{name}.py" for name in part.tests]
    options = ["-x", "-q", "-p", "no:cacheprovider", "-k", "not mrcal"]  # it starts a Python each time
    paths = os.pathsep.join(str(copy / folder) for folder in ("", "plugins"))
    environment = {**os.environ, "PYTHONPATH": paths, "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-m", "pytest", *options, *tests]
    try:
        done = subprocess.run(command, cwd=copy, env=environment, capture_output=True, timeout=timeout_s)
    except subprocess.TimeoutExpired:
        return "hang"
    return "fail" if done.returncode else "pass"


def tried(copy: Path, part: Part, chosen: list[Mutant]) -> list[str]:
    """The outcome of each."""
    started = time.perf_counter()
    if outcome(copy, part, 600) != "pass":
        sys.exit(f"the tests of {part.name} fail without any change")
    timeout_s = 60 + 5 * (time.perf_counter() - started)
    found = []
    for number, mutant in enumerate(chosen, start=1):
        path = copy / mutant.file
        path.write_text(mutant.after, encoding="utf-8")
        found.append(outcome(copy, part, timeout_s) if compiled(copy) else "fail")
        path.write_text(mutant.before, encoding="utf-8")
        print(f"{part.name}: {number} of {len(chosen)}, {found.count('pass')} survive", file=sys.stderr, flush=True)
    return found


def main() -> None:
    """Try the parts named, or all, and print the table and what survived."""
    os.chdir(ROOT)  # where mutmut looks for its settings
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 40
    parts = [part for part in PARTS if part.name in sys.argv[2:] or len(sys.argv) < 3]
    header = "| part | changes in all | tried | noticed | of these by not ending | share noticed | 95 % interval |"
    rows, shown = [header, "|---|---|---|---|---|---|---|"], []
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        for name in COPIED:
            copied = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
            copied(ROOT / name, Path(folder) / name)
        for part in parts:
            every = mutants_of(part)
            drawn = np.random.default_rng(SEED).permutation(len(every))[:count]
            chosen = [every[index] for index in drawn]
            found = tried(Path(folder), part, chosen)
            noticed = len(found) - found.count("pass")
            low, high = binomtest(noticed, len(drawn)).proportion_ci(method="wilson")
            share = f"{noticed / len(drawn):.0%} | {low:.0%} to {high:.0%}"
            rows.append(f"| {part.name} | {len(every)} | {len(drawn)} | {noticed} | {found.count('hang')} | {share} |")
            left = [mutant for mutant, what in zip(chosen, found, strict=True) if what == "pass"]
            shown += [f"```diff\n{mutant.change}\n```" for mutant in left]
    print("\n".join(rows), "\nWhat survived:\n", *shown, sep="\n")


if __name__ == "__main__":
    main()
