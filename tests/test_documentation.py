"""The documentation is true: every code block and every command in it is run, every name and code in it exists.

A block that cannot be run says why in the line before: ``<!-- not run: reason -->``. The blocks of a page run one after
another in a folder of their own, in which a few small photographs of the board that all pages speak of wait, and the
camera and the report that `FIRST`, which several pages begin with, made from them: it is run once. What is changed to
save time is in `SHORTER`.
"""

import json
import re
import shlex
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
import typer
import yaml
from format_files_calibration import FILES
from json_page import documented
from typer.testing import CliRunner

import opencsp_calib
from opencsp_calib import Camera, Checkerboard, cli
from opencsp_calib.images import write_image
from opencsp_calib.looking import OTHER_BOARD
from opencsp_calib.models import LENS_MODELS
from opencsp_calib.rendering import render
from opencsp_calib.synthetic import seed_poses

ROOT = Path(__file__).resolve().parents[1]
GENERATED = {"commands.md", "modules.md", "studies.md"}
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
PAGES += [page for page in sorted((ROOT / "docs").glob("*.md")) if page.name not in GENERATED]
SHORTER = {
    "opencsp-calib demo demo": "opencsp-calib demo demo --views 4",
}
FIRST = "opencsp-calib calibrate photographs/ --board checkerboard:21x18:20mm -o camera.h5 --report report.html"
BOARD = Checkerboard(21, 18, 0.02)
KALIBR_CAM = """cam{}:
  camera_model: {}
  distortion_coeffs: [{}]
  distortion_model: {}
  intrinsics: [{}900.5, 901.5, 502.0, 398.5]
  resolution: [1000, 800]
"""
MATRIX = "{}: !!opencv-matrix\n  rows: {}\n  cols: {}\n  dt: d\n  data: [{}]\n"
OTHERS = {
    "theirs.yaml": FILES["ros"]["ost.yaml"],
    "rig.yaml": "".join(
        KALIBR_CAM.format(n, "pinhole", "-0.1, 0.02, 0.001, -0.002", "radtan", "") for n in (0, 1)
    ).encode(),
    "intrinsics.yml": (
        "%YAML:1.0\n---\n"
        + "".join(
            MATRIX.format(f"M{n}", 3, 3, "900.5, 0., 640., 0., 901.5, 480., 0., 0., 1.")
            + MATRIX.format(f"D{n}", 1, 5, "-0.1, 0.02, 0.001, -0.002, 0.")
            for n in (1, 2)
        )
    ).encode(),
    "fisheye.yaml": KALIBR_CAM.format(0, "eucm", "", "none", "0.6, 1.1, ").encode(),
}
PARSED = {"json": json.loads, "yaml": yaml.safe_load}
UNTESTED = {"text"}  # what is only shown: outputs, trees of files


@dataclass(frozen=True)
class Block:
    """A fenced block of a page."""

    language: str
    text: str
    line: int
    excuse: str


def blocks(page: Path) -> Iterator[Block]:
    fence = re.compile(r"(?:<!-- not run: ([^\n]*) -->\n)?^( *)```([^\n]*)\n(.*?)^ *```$", re.MULTILINE | re.DOTALL)
    text = page.read_text(encoding="utf-8")
    for found in fence.finditer(text):
        excuse, _, language, body = found.groups()
        if not language.startswith("{"):  # directives are Sphinx's
            yield Block(language, body, text[: found.start()].count("\n") + 1, excuse or "")


def run_shell(text: str) -> None:
    """Each line, by our own command line in this process."""
    for line in text.replace("\\\n", " ").splitlines():
        command = shlex.split(line, comments=True)
        if not command:
            continue
        plain = shlex.join(command)
        if command[0] == "make":
            targets = re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
            assert command[1] in targets, f"there is no {plain}"
            continue
        assert command[0] == "opencsp-calib", f"not run by this test, and not excused: {plain}"
        if plain != FIRST:
            assert cli.run(shlex.split(SHORTER.get(plain, plain))[1:]) == 0, plain


@pytest.fixture(scope="module")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the pages take for given."""
    folder = tmp_path_factory.mktemp("documentation")
    camera = Camera("photographs", "opencv4", [1310.0, 1310.0, 523.0, 391.0, -0.15, 0.1, 4e-4, -3e-4], (1040, 780))
    poses = seed_poses(BOARD, camera, 14, rng=1)
    for name, chosen in (("photographs", poses[::2]), ("second_set", poses[1::2])):
        (folder / name).mkdir()
        for number, pose in enumerate(chosen):
            write_image(render(camera, BOARD, pose, rng=number).pixels, folder / name / f"{number:02d}.png")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert cli.run(shlex.split(FIRST)[1:]) == 0
    for name, content in OTHERS.items():
        (folder / name).write_bytes(content)
    return folder


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_block_runs(page: Path, prepared: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(prepared, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for block in blocks(page):
        if block.excuse or block.language in UNTESTED:
            continue
        try:
            if block.language == "python":
                exec(compile(block.text, f"{page.name}:{block.line}", "exec"), names)  # noqa: S102  # ours
            elif block.language in PARSED:
                PARSED[block.language](block.text)
            else:
                assert block.language == "", f"{block.language!r} is not run by this test"
                run_shell(block.text)
        except BaseException as error:
            raise AssertionError(f"{page.name}, line {block.line}: {error!r}") from error


def test_every_link_leads_somewhere() -> None:
    for page in PAGES:
        for target in re.findall(r"\]\(([^)#\s]+)", page.read_text(encoding="utf-8")):
            if not target.startswith("http"):
                path = page.parent / target
                assert path.exists() or path.name in GENERATED, f"{page.name} leads to {target}"


def test_every_public_name_is_on_the_page_of_python() -> None:
    text = (ROOT / "docs/api.md").read_text(encoding="utf-8")
    missing = [name for name in opencsp_calib.__all__ if f"opencsp_calib.{name}\n" not in text]
    assert not missing


def test_what_every_command_prints_for_programs_is_on_a_page() -> None:
    commands = typer.main.get_command(cli.app).commands
    printing = {name for name, command in commands.items() if any("--json" in p.opts for p in command.params)}
    assert set(documented()) == printing


def test_every_warning_is_among_the_symptoms() -> None:
    said = (ROOT / "docs/symptoms.md").read_text(encoding="utf-8")
    files = [*(ROOT / "opencsp_calib").rglob("*.py"), *(ROOT / "plugins").rglob("*.py")]
    source = "\n".join(path.read_text(encoding="utf-8") for path in files)
    codes = set(re.findall(r"Problem\(\s*\"([a-z-]+)\"", source))
    codes |= set(re.findall(r"^[A-Z_]+ = \"([a-z]+-[a-z-]+)\"  # the problem of", source, re.MULTILINE))
    assert len(codes) > 30
    assert OTHER_BOARD in codes
    assert sorted(code for code in codes if f"`{code}`" not in said) == []


def test_the_page_of_commands_is_the_commands_own_help(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(ROOT / "docs" / "scripts")
    from command_page import page

    text = page()
    assert set(re.findall(r"^## (\S+)$", text, re.MULTILINE)) == set(typer.main.get_command(cli.app).commands)
    for command in typer.main.get_command(cli.app).commands:
        said = CliRunner().invoke(cli.app, [command, "--help"], env={"COLUMNS": "300", "TERM": "dumb"}).output
        section = text.partition(f"\n## {command}\n")[2].partition("\n## ")[0]
        options = set(re.findall(r"--[a-z][a-z-]+", said)) - {"--help"}
        assert options <= set(re.findall(r"--[a-z][a-z-]+", section)), command


def test_every_command_is_in_the_readme() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert [name for name in typer.main.get_command(cli.app).commands if f"`{name}`" not in text] == []


def test_every_study_has_a_claim_and_a_result_with_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(ROOT / "validation")
    import bench

    in_short = (ROOT / "docs/validation.md").read_text(encoding="utf-8")
    for name, study in bench.studies().items():
        assert bench.head_of(study)
        assert (bench.RESULTS / f"{name}.md").is_file(), f"{name} has never been run"
        assert f"| `{name}` |" in in_short, f"{name} has no line in docs/validation.md"
    for result in bench.RESULTS.glob("*.md"):
        head, figures, found = result.read_text(encoding="utf-8").partition(bench.FIGURES)
        assert re.match(r"# .*\*\*Claim\.\*\* .*\*\*Way\.\*\* ", head, re.DOTALL), result.name
        assert figures, result.name
        assert re.match(r"\n20[0-9-]{8}, ", found), f"{result.name}: when, and on what?"
        assert result.stem in bench.studies(), f"{result.name} is of no study"


def test_every_lens_model_has_a_figure() -> None:
    text = (ROOT / "docs/models.md").read_text(encoding="utf-8")
    assert [name for name in LENS_MODELS if f"### {name}\n" not in text or f"images/lens_{name}.png" not in text] == []
