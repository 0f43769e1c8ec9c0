"""A throw-away environment to install packages into, for tests of what is published."""

import json
import os
import subprocess
import sys
import venv
from pathlib import Path


class Environment:
    """An environment that borrows the packages of this one; pip installs into it without asking the network."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        venv.create(folder, with_pip=False)
        self.python = str(next(folder.glob("[bS]*/python*")))
        borrowed = "\n".join(path for path in sys.path if path and Path(path).is_dir())
        site = self.run("-c", "import sysconfig; print(sysconfig.get_path('purelib'))").stdout.strip()
        (Path(site) / "borrowed.pth").write_text(borrowed)

    def run(self, *arguments: str, code: int = 0) -> subprocess.CompletedProcess[str]:
        kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "COV"))}
        command = [self.python, *arguments]  # from its own folder: Python looks for modules where it is started
        done = subprocess.run(command, capture_output=True, text=True, env=kept, cwd=self.folder)
        assert done.returncode == code, done.stdout + done.stderr
        return done

    def pip(self, *arguments: str) -> None:
        command = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check", "--python", self.python]
        done = subprocess.run([*command, *arguments], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr

    def install(self, package: Path) -> None:
        """From a project or a wheel."""
        self.pip("install", "--no-index", "--no-deps", "--no-build-isolation", str(package))

    def plugins(self) -> set[tuple[str, str]]:
        """Kind and name of all that is provided there."""
        listed = json.loads(self.run("-m", "opencsp_calib", "plugins", "--json").stdout)["plugins"]
        return {(entry["kind"], entry["name"]) for entry in listed}
