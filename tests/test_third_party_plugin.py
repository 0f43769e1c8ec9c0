"""A stranger's distribution, docs/example_plugin, installed by pip as anybody would: found, conforming, removable.

It goes into an environment of its own, made for the test, which borrows the packages of this one.
"""

import shutil
from pathlib import Path

import pytest
from environments import Environment

pytestmark = pytest.mark.timeout(1200)  # pip starts several times

EXAMPLE = Path(__file__).resolve().parents[1] / "docs" / "example_plugin"
BROKEN = """
[build-system]
requires = ["hatchling"]
build-backend = "hatchling.build"
[project]
name = "broken-plugin"
version = "0.3"
[project.entry-points.opencsp_calib]
broken = "broken_plugin"
[tool.hatch.build.targets.wheel]
only-include = ["broken_plugin.py"]
"""


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> Environment:
    pytest.importorskip("hatchling", reason="the example is built with hatchling")
    return Environment(tmp_path_factory.mktemp("environment") / "environment")


@pytest.fixture(scope="module")
def before(environment: Environment) -> set[tuple[str, str]]:
    """What is provided without any plugin of a stranger."""
    return environment.plugins()


def test_the_example_is_found_keeps_its_promises_and_goes_away_again(
    environment: Environment, before: set[tuple[str, str]], tmp_path: Path
) -> None:
    provided = {("board", "circles"), ("detector", "circles"), ("camera format", "open3d")}
    assert not provided & before
    example = shutil.copytree(EXAMPLE, tmp_path / "example", ignore=shutil.ignore_patterns("__pycache__"))
    environment.install(example)
    assert environment.plugins() == before | provided
    assert "plugin circles: opencsp-calib-circles 1.0" in environment.run("-m", "opencsp_calib", "--version").stdout
    pdf = tmp_path / "board.pdf"
    environment.run("-m", "opencsp_calib", "board", "circles:7x5:30mm:14mm", "-o", str(pdf))
    assert pdf.read_bytes().startswith(b"%PDF")
    tests = environment.run("-m", "pytest", "-q", "-p", "no:cacheprovider", str(example / "tests"))
    assert " passed" in tests.stdout
    environment.pip("uninstall", "--yes", "opencsp-calib-circles")
    assert environment.plugins() == before


def test_a_broken_one_is_left_out_with_a_warning(
    environment: Environment, before: set[tuple[str, str]], tmp_path: Path
) -> None:
    project = tmp_path / "broken"
    project.mkdir()
    (project / "pyproject.toml").write_text(BROKEN)
    (project / "broken_plugin.py").write_text("import a_package_that_nobody_has\n")
    environment.install(project)
    said = environment.run("-m", "opencsp_calib", "plugins").stderr
    assert "warning: plugin 'broken' (broken_plugin) was left out" in said
    assert "a_package_that_nobody_has" in said
    assert environment.plugins() == before
    assert "plugin broken: broken-plugin 0.3" in environment.run("-m", "opencsp_calib", "--version").stdout
