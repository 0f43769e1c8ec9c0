"""What is published: wheel and sdist, built and looked into, and the wheel at work in an environment of its own."""

import re
import runpy
import shutil
import subprocess
import sys
import tarfile
import zipfile
from importlib.metadata import version
from pathlib import Path

import pytest
import yaml
from environments import Environment

from opencsp_calib.native import SUFFIX

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The wheel, made from the sdist as installers do, and the sdist."""
    pytest.importorskip("hatchling", reason="it is built with hatchling")
    folder = tmp_path_factory.mktemp("dist")
    build = [sys.executable, "-m", "hatchling", "build", "--directory", str(folder), "--target", "sdist"]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True)
    (sdist,) = folder.glob("*.tar.gz")
    build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", str(folder), str(sdist)]
    subprocess.run(build, check=True, capture_output=True)
    (wheel,) = folder.glob("*.whl")
    return wheel, sdist


def test_the_wheel_holds_what_runs_and_nothing_else(built: tuple[Path, Path]) -> None:
    with zipfile.ZipFile(built[0]) as archive:
        names = set(archive.namelist())
        metadata = archive.read(f"opencsp_calib-{PROJECT['version']}.dist-info/METADATA").decode()
    tops = {name.partition("/")[0] for name in names}
    packages = {path.name for path in (ROOT / "plugins").iterdir() if (path / "__init__.py").is_file()}
    assert tops == {"opencsp_calib", *packages, f"opencsp_calib-{PROJECT['version']}.dist-info"}
    assert {"opencsp_calib/py.typed", "opencsp_calib/report/style.css"} <= names
    assert f"opencsp_calib/_native{SUFFIX}" in names
    assert re.search(r"-py3-none-(?!any)", built[0].name)  # one for all versions of Python, of one kind of machine
    assert any(name.endswith("dist-info/licenses/LICENSE") for name in names)
    assert not [name for name in names if re.search(r"__pycache__|test_|conftest|\.png$", name)]
    tracked = subprocess.run(["git", "ls-files", "opencsp_calib", "plugins"], cwd=ROOT, capture_output=True, text=True)
    if tracked.returncode == 0:  # from a clone: every file that is kept is in it
        assert {name.removeprefix("plugins/") for name in tracked.stdout.split()} <= names
    assert "License-Expression: Apache-2.0" in metadata
    for extra in PROJECT["optional-dependencies"]:
        assert f"Provides-Extra: {extra}" in metadata


def test_the_sdist_holds_all_to_test_and_document_it(built: tuple[Path, Path]) -> None:
    with tarfile.open(built[1]) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    wanted = {"LICENSE", "README.md", "CHANGELOG.md", "CITATION.cff", "Makefile", "tests/conftest.py", "docs/conf.py"}
    wanted |= {"native/build_hook.py", "native/corner_fit.c", "native/exported.h"}
    wanted |= {"plugins/opencsp_calib_opencv/__init__.py", "validation/bench.py", ".ci/system-packages"}
    assert wanted <= names
    assert not [name for name in names if "_build" in name or "__pycache__" in name]


def test_the_wheel_works_in_an_environment_of_its_own(built: tuple[Path, Path], tmp_path: Path) -> None:
    environment = Environment(tmp_path / "environment")
    environment.install(built[0])
    where = environment.run("-c", "import opencsp_calib; print(opencsp_calib.__file__)").stdout
    assert str(tmp_path) in where
    said = environment.run("-m", "opencsp_calib", "--version").stdout
    assert said.startswith(f"opencsp-calib {PROJECT['version']},")
    assert {("solver", "bundle"), ("solver", "opencv"), ("detector", "checkerboard")} <= environment.plugins()


def test_a_machine_without_a_compiler_gets_one(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    pytest.importorskip("hatchling", reason="it is built with hatchling")
    hook = runpy.run_path(str(ROOT / "native" / "build_hook.py"))["NativeLibraries"]
    monkeypatch.setattr(shutil, "which", lambda _: None)
    monkeypatch.delenv("CC", raising=False)

    def fetched(root: Path) -> list[str]:
        return hook(str(root), {}, None, None, str(tmp_path), "wheel").dependencies()

    assert [name.partition(">")[0] for name in fetched(tmp_path)] == ["ziglang"]
    monkeypatch.setenv("CC", "ccache gcc")
    assert fetched(tmp_path) == []


def test_the_version_is_in_one_place_and_the_others_agree() -> None:
    assert version("opencsp-calib") == PROJECT["version"]
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert cited["version"] == PROJECT["version"]
    assert cited["license"] == PROJECT["license"]
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert re.search(r"^## (\S+)", changes, re.MULTILINE)[1] == PROJECT["version"]


def test_all_is_every_extra() -> None:
    extras = dict(PROJECT["optional-dependencies"])
    (everything,) = extras.pop("all")
    assert set(re.search(r"\[(.*)\]", everything)[1].split(",")) == set(extras)
