"""The machine code of the corner fit: when it is made, where it is kept, and who may have put it there."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from opencsp_calib import compiled


def test_importing_loads_no_compiler() -> None:
    code = "import sys, opencsp_calib.corners; sys.exit('numba' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_read_only_installation_without_a_home_keeps_its_code_in_a_private_folder(tmp_path: Path) -> None:
    package = Path(compiled.__file__).parent
    installation = tmp_path / "installation" / "opencsp_calib"
    shutil.copytree(package, installation, ignore=shutil.ignore_patterns("__pycache__", "gui", "report"))
    (installation / "corner_kernel" / "__pycache__").touch()  # a file, so that not even root can write into it
    nowhere = os.devnull + "/nowhere"
    places = {
        "PYTHONPATH": str(installation.parent),
        "HOME": nowhere,
        "XDG_CACHE_HOME": nowhere,
        "TMPDIR": str(tmp_path),
    }
    code = "from opencsp_calib.compiled import corner_fit; corner_fit()"
    environment = {key: value for key, value in os.environ.items() if key != "NUMBA_CACHE_DIR"} | places
    kept = []
    for _ in range(2):
        subprocess.run([sys.executable, "-c", code], check=True, env=environment, cwd=tmp_path)
        (folder,) = tmp_path.glob("opencsp-calib-compiled-*")
        assert folder.stat().st_mode & 0o077 == 0
        kept.append({file.name: file.stat().st_mtime_ns for file in folder.rglob("*.nbc")})
    assert kept[0]
    assert kept[0] == kept[1]


def test_compiled_code_is_of_what_every_file_of_the_kernel_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kernel = tmp_path / "corner_kernel"
    shutil.copytree(compiled.KERNEL, kernel, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(compiled, "KERNEL", kernel)
    versions = {compiled._version()}
    for file in sorted(kernel.glob("*.py")):
        file.write_text(file.read_text(encoding="utf-8") + "# changed\n", encoding="utf-8")
        versions.add(compiled._version())
    assert len(versions) == 1 + len(list(kernel.glob("*.py")))


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="owners and modes are not kept here")
def test_a_folder_others_can_write_to_is_not_trusted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiled.tempfile, "gettempdir", lambda: str(tmp_path))
    folder = tmp_path / f"opencsp-calib-compiled-{os.geteuid()}"
    folder.mkdir()
    folder.chmod(0o777)
    with pytest.raises(PermissionError, match="belongs to somebody else"):
        compiled._private()
