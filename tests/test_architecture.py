"""Who may import whom, what importing costs, and which names are public: design rules that only a test keeps."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import opencsp_calib

CORE = Path(opencsp_calib.__file__).parent
ROOT = CORE.parent
PLUGINS = ROOT / "plugins"

TIERS = (
    "errors counted process_setting stopping",
    "arrays atomic native opencv blas processes provenance seal hdf5_reading hdf5_writing",
    "models",
    "camera rotations convex_hull board",
    "pose",
    "image image_bytes detection options",
    "view_json typed",
    "calibration",
    "images undistortion corner_table unknowns valley jacobian triangular schur leaving_out leverage normal_equations",
    "subpix",
    "corner_kernel corner_grid corner_windows corner_fit corner_judgement corners",
    "quality photograph comparison projection_sigma information uncertainty hdf5 hdf5_calibration opencsp",
    "drawing board_file",
    "synthetic rendering resampling initial pose_fit flatness lens_fit free_board convergence dropping",
    "shape_evidence board_shape",
    "selecting",
    "judgement",
    "summary",
    "interfaces",
    "solving importing hookspecs",
    "registry",
    "asking looking conformance",
    "journal cluster",
    "detecting",
    "pipeline demo camera_files",
    "trials solver_comparison validate check coach fleet_file",
    "fleet",
    "capture",
    "report",
    "cli gui",
    "__main__",
)
RANK = {module: rank for rank, tier in enumerate(TIERS) for module in tier.split()}
ONE_LINERS = {"camera"}  # Camera.load, save, undistort ... import inside, the only exception


def modules(folder: Path) -> list[Path]:
    return sorted(folder.rglob("*.py"))


def imported(path: Path) -> set[str]:
    """The modules that a file imports anywhere, as dotted names."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path.name}, line {node.lineno}: relative, which hides what is imported"
            names |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def own_module(path: Path) -> str:
    return path.relative_to(CORE).parts[0].removesuffix(".py")


def test_the_order_of_imports_is_of_the_modules_that_there_are() -> None:
    assert set(RANK) == {own_module(path) for path in modules(CORE)} - {"__init__"}


@pytest.mark.parametrize("path", modules(CORE), ids=lambda p: str(p.relative_to(CORE)))
def test_core_imports_only_what_comes_before(path: Path) -> None:
    module = own_module(path)
    if module == "__init__":
        return
    assert module in RANK, f"{module} is not in the order of imports: add it to the design and here"
    for name in imported(path):
        assert not name.startswith("opencsp_calib_"), f"the core must not know the plugin {name}"
        parts = name.split(".")
        if parts[0] == "opencsp_calib" and len(parts) > 1 and parts[1] in RANK and parts[1] != module:
            assert RANK[parts[1]] <= RANK[module] or module in ONE_LINERS, f"{module} must not import {parts[1]}"


@pytest.mark.parametrize("path", modules(PLUGINS), ids=lambda p: str(p.relative_to(PLUGINS)))
def test_a_plugin_imports_the_core_and_never_another_plugin(path: Path) -> None:
    own = path.relative_to(PLUGINS).parts[0]
    for name in imported(path):
        top = name.split(".")[0]
        assert not top.startswith("opencsp_calib_") or top == own, f"{own} must not import {top}"


def loaded_by(statement: str) -> set[str]:
    code = f"import sys\n{statement}\nprint(*sorted({{m.split('.')[0] for m in sys.modules}}))"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = set(result.stdout.splitlines()[-1].split())
    assert "opencsp_calib" in loaded
    return loaded


HEAVY = {"cv2", "matplotlib", "nicegui", "fastapi", "pycolmap", "mrcal", "pypylon", "distributed", "h5py"}


@pytest.mark.parametrize(
    "statement",
    [
        "import opencsp_calib",
        "from opencsp_calib.cli import run; run(['--help'])",
        "from opencsp_calib.registry import installed; installed()",
    ],
)
def test_nothing_heavy_is_loaded_before_it_is_used(statement: str) -> None:
    assert not loaded_by(statement) & HEAVY


def test_public_names_are_sorted_and_exist() -> None:
    assert opencsp_calib.__all__ == sorted(opencsp_calib.__all__)
    for name in opencsp_calib.__all__:
        assert getattr(opencsp_calib, name) is not None


def test_a_file_stays_within_300_lines() -> None:
    folders = [folder for name in ("tests", "validation", "docs", "native") if (folder := ROOT / name).is_dir()]
    files = [
        path for folder in (CORE, PLUGINS, *folders) for path in folder.rglob("*") if path.suffix in (".py", ".c", ".h")
    ]
    assert {path.name: n for path in files if (n := len(path.read_text(encoding="utf-8").splitlines())) > 300} == {}
