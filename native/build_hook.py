"""Compiles the C files beside it while opencsp-calib is being installed, or its wheel built.

The compiler is the one that the environment variable CC names, else the machine's own, else zig's, which pip fetches.
There are two libraries: one for every processor of the kind, and on x86-64 a quicker one for those with AVX2.
"""

import hashlib
import os
import platform
import shlex
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

SOURCES = Path(__file__).parent
SUFFIX = {"win32": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")
X86 = platform.machine().lower() in ("x86_64", "amd64")
VARIANTS = {"": (), **({"_avx2": ("-mavx2", "-mfma")} if X86 else {})}

# Sums may be taken in any order, so that loops do several pixels at once; NaN and infinity keep their meaning.
OPTIONS = (
    "-std=c11", "-O3", "-shared", "-s", "-fvisibility=hidden", "-Wall", "-Wextra",
    "-fno-math-errno", "-fno-trapping-math", "-fno-signed-zeros", "-fassociative-math", "-freciprocal-math",
    "-ffp-contract=fast",
)  # fmt: skip


class NativeLibraries(BuildHookInterface):  # type: ignore[type-arg]
    """The build step that hatchling calls."""

    def dependencies(self) -> list[str]:
        """What pip has to fetch before the build: a compiler, if there is none and something to compile."""
        return ["ziglang>=0.13"] if _own_compiler() is None and not self._made() else []

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Make the libraries where the package is, so that an editable installation finds them too."""
        if not self._made():
            compiler = _own_compiler() or _zig()
            for variant, options in VARIANTS.items():
                _compile([*compiler, *OPTIONS, *options], self._library(variant))
        build_data["pure_python"] = False
        machine = sysconfig.get_platform().replace("-", "_").replace(".", "_")
        build_data["tag"] = f"py3-none-{machine}"  # no part of Python is linked: one wheel for all versions
        build_data["artifacts"] += [f"/opencsp_calib/{self._library(variant).name}" for variant in VARIANTS]

    def _library(self, variant: str) -> Path:
        return Path(self.root) / "opencsp_calib" / f"_native{variant}{SUFFIX}"

    def _made(self) -> bool:
        """Whether all libraries are there, and newer than what they are made of."""
        libraries = [self._library(variant) for variant in VARIANTS]
        newest = max(file.stat().st_mtime for file in SOURCES.iterdir() if file.is_file())
        return all(library.exists() and library.stat().st_mtime > newest for library in libraries)


def _own_compiler() -> list[str] | None:
    if os.environ.get("CC"):
        return shlex.split(os.environ["CC"])
    found = next((name for name in ("gcc", "clang") if shutil.which(name)), None)
    return [found] if found and sys.platform != "win32" else None


def _zig() -> list[str]:
    """Zig's compiler would make code for this very processor; told a target it does so for all of the kind."""
    system = {"win32": "windows-gnu", "darwin": "macos"}.get(sys.platform, "linux-gnu.2.17")
    machine = "x86_64" if X86 else "aarch64"
    return [sys.executable, "-m", "ziglang", "cc", "-target", f"{machine}-{system}"]


def _compile(command: list[str], library: Path) -> None:
    position = () if sys.platform == "win32" else ("-fPIC",)
    sources = [str(source) for source in sorted(SOURCES.glob("*.c"))]
    code = b"".join(file.read_bytes() for file in sorted(SOURCES.glob("*.[ch]")))
    made_of = f'-DMADE_OF="{hashlib.sha256(code).hexdigest()}"'
    new = library.with_name(f"new-{library.name}")  # a library in use must not be written over
    try:
        subprocess.run([*command, *position, made_of, "-o", str(new), *sources, "-lm"], check=True)
    except (OSError, subprocess.CalledProcessError) as error:
        raise SystemExit(f"the C part of opencsp-calib could not be compiled: {error}") from None
    new.replace(library)
