"""Many cameras in one run: isolated failures, verdicts, what has changed since last time, files that are wrong."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from command_line import answer, complaint
from worlds import SmallWorld

from opencsp_calib import Camera
from opencsp_calib.cli import run
from opencsp_calib.fleet_file import find_fleet
from opencsp_calib.hdf5_calibration import load_calibration

BOARD = ("--board", SmallWorld.spec)


@pytest.fixture(scope="module")
def refocused(small_world: SmallWorld, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same camera after somebody has turned its lens: the focal length is half a percent longer."""
    folder = tmp_path_factory.mktemp("refocused")
    params = small_world.camera.params.copy()
    params[:2] *= 1.005
    replace(small_world, camera=Camera("refocused", "opencv4", params, (640, 480))).photograph(folder)
    return folder


def link(photographs: Path, folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for path in sorted(photographs.glob("*.png"))[1:11]:  # at least ten, or they are too few to be good
        (folder / path.name).write_bytes(path.read_bytes())


def test_a_fleet(photographs: Path, refocused: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Three cameras, of which one fails; then again with one of the others refocused."""
    link(photographs, tmp_path / "north & east")
    link(photographs, tmp_path / "south")
    (tmp_path / "west").mkdir()
    (tmp_path / "west" / "1.png").write_bytes(b"no image")
    (tmp_path / "notes").mkdir()
    (tmp_path / "fleet.yaml").write_text(f"board: {SmallWorld.spec}\nsolver: opencv\n")
    first = answer(capsys, "fleet", tmp_path, code=1)
    assert [(one["name"], one["verdict"]) for one in first["cameras"]] == [
        ("north & east", "good"), ("south", "good"), ("west", "failed"),
    ]  # fmt: skip
    assert [one["change"] for one in first["cameras"]] == [None, None, None]
    assert "1.png" in first["cameras"][2]["sentence"]
    assert load_calibration(tmp_path / "south" / "camera.h5").camera.name == "south"
    page = Path(first["report"]).read_text(encoding="utf-8")
    assert 'href="north%20%26%20east/report.html"' in page
    assert "north &amp; east" in page

    link(refocused, tmp_path / "south")
    (tmp_path / "west" / "1.png").unlink()
    second = answer(capsys, "fleet", tmp_path / "fleet.yaml")
    assert [one["verdict"] for one in second["cameras"]] == ["good", "good"]
    here, south = (one["change"] for one in second["cameras"])
    assert (here["level"], south["level"]) == ("unchanged", "changed")
    assert "the same photographs" in here["sentence"]
    assert "same photographs" not in south["sentence"]
    assert south["worst_px"] > 1 > here["worst_px"]
    assert not list(tmp_path.rglob("*.journal"))


def test_results_elsewhere_and_settings_of_one_camera(
    photographs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    link(photographs, tmp_path / "photographs")
    file = tmp_path / "mine.yaml"
    file.write_text(
        f"board: {SmallWorld.spec}\nsolver: opencv\ncameras:\n"
        "  few:\n    images: [photographs/0*.png, photographs/1*.png]\n    exclude: [03.png]\n    select: 7\n"
        "    model: opencv5\n    note: {lens: 8 mm}\n    pixel-pitch: 4.4\n"
        "  none: {images: nowhere}\n"
    )
    found = answer(capsys, "fleet", file, "-o", tmp_path / "results", code=1)
    assert [one["views_used"] for one in found["cameras"]] == [7, None]
    few = load_calibration(tmp_path / "results" / "few" / "camera.h5")
    assert few.camera.model == "opencv5"
    assert few.record == {"lens": "8 mm", "pixel_pitch_um": "4.4"}
    statuses = {view.image: view.problems[-1].code for view in few.observations.views if view.status == "dropped"}
    assert statuses["03.png"] == "excluded"
    assert sorted(path.name for path in (tmp_path / "photographs").iterdir())[0] == "02.png"
    assert (tmp_path / "results" / "fleet.html").exists()
    assert "nowhere" in found["cameras"][1]["sentence"]


LAUGHS = "".join(f"- &a{i} [{', '.join([f'*a{i - 1}'] * 7)}]\n" for i in range(1, 12))
"""Seven times as much at each line: two thousand million texts, were they written out."""


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("bord: x\ncameras: {a: {}}", ":1: there is no setting 'bord'; is 'board' meant?"),
        ("cameras:\n  a:\n    select: many", ":3: 'select' must be a whole number, at least 3, not 'many'"),
        ("cameras:\n  a: {}\n  a: {}", ":3: 'a' is there twice"),
        ("cameras:\n  ../a: {}", ":2: a camera cannot be called '../a'"),
        ("cameras: [a, b]", ":1: here must be lines of the form name: value"),
        ("cameras:\n  a: 7", ":2: here must be lines"),
        ("board: [\n", "this is not YAML"),
        ("board: !!python/object/apply:os.system [ls]", ":1: this cannot be read"),
        ("note: {a: 2026-99-99}", ":1: this cannot be read"),
        ("robust: perhaps", ":1: 'robust' must be yes or no"),
        ("note: {a: [b]}", ":1: 'note' must be pairs"),
        ("pixel-pitch: .nan", ":1: 'pixel-pitch' must be"),
        ("? [a]\n: b", ":1: a name must be a word"),
        ("model:\n- &a0 [x, x, x, x, x, x, x]\n" + LAUGHS, ":1: 'model' must be a text, not ["),
        ("", "is empty"),
        ("cameras: {}", "has no cameras"),
        ("a: " + "[" * 1500, "this is not YAML"),
        ("- " * 3, ":1: here must be lines"),
    ],
)
def test_a_wrong_file_is_told_with_its_line(
    text: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "fleet.yaml"
    file.write_text(text)
    assert run(["fleet", str(file)]) == 2
    said = capsys.readouterr().err.strip()
    assert words in said
    assert len(said.splitlines()) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["fleet.yaml"]


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda path: path / "nowhere", "no such folder or file"),
        (lambda path: path, "has no cameras"),
    ],
)
def test_wrong_use(
    make: Callable[[Path], Path], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert words in complaint(capsys, "fleet", make(tmp_path), *BOARD)


def test_a_board_must_be_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "1.png").write_bytes(b"")
    assert "--board SPEC" in complaint(capsys, "fleet", tmp_path)
    assert "'foo'" in complaint(capsys, "fleet", tmp_path, "--board", "foo")
    assert "'magic'" in complaint(capsys, "fleet", tmp_path, *BOARD, "--solver", "magic")
    assert [path.name for path in tmp_path.iterdir()] == ["a"]
    (tmp_path / "fleet.yaml").write_text(f"cameras: {{a: {{}}, b: {{images: a, board: '{SmallWorld.spec}'}}}}")
    failed = answer(capsys, "fleet", tmp_path, code=1)["cameras"]
    assert ["--board SPEC" in camera["sentence"] for camera in failed] == [True, False]


def test_folders_in_natural_order(tmp_path: Path) -> None:
    for name in ("camera10", "camera2"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "1.png").write_bytes(b"")
    assert [camera.name for camera in find_fleet(tmp_path, {})] == ["camera2", "camera10"]
