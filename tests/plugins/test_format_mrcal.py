"""mrcal: its own projection of every lens model, and its own reading of what we write; JPL's files as mrcal reads them.

mrcal lives in Debian's Python; it is asked once for all tests.
"""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
from format_truth import agree, directions
from opencsp_calib_formats.cahvor import Cahvor
from opencsp_calib_formats.mrcal_cameramodel import MrcalCameraModel

from opencsp_calib import Camera, InputError
from opencsp_calib.errors import FileFormatError, NotExactError
from opencsp_calib.importing import exact, fitted
from opencsp_calib.interfaces import Imported

CORE = [900.5, 901.5, 502.0, 398.5]
BENT = [0.01, -0.02, 0.02, -0.01, 0.003]
MODELS = {
    "LENSMODEL_PINHOLE": [],
    "LENSMODEL_OPENCV4": [-0.1, 0.02, 0.001, -0.002],
    "LENSMODEL_OPENCV5": [-0.1, 0.02, 0.001, -0.002, -0.003],
    "LENSMODEL_OPENCV8": [-0.1, 0.02, 0.001, -0.002, -0.003, 0.01, 0.02, 0.003],
    "LENSMODEL_OPENCV12": [-0.1, 0.02, 0.001, -0.002, -0.003, 0.01, 0.02, 0.003, 1e-3, 2e-4, -1e-3, 3e-4],
    "LENSMODEL_STEREOGRAPHIC": [],
    "LENSMODEL_LONLAT": [],
    "LENSMODEL_LATLON": [],
    "LENSMODEL_CAHVOR": BENT,
    "LENSMODEL_CAHVORE_linearity=0.37": [*BENT, 0.01, 0.002, -0.001],
    "LENSMODEL_CAHVORE_linearity=0": [*BENT, 0.01, 0.002, -0.001],
}
EXACT = [model for model in MODELS if "OPENCV" in model or "PINHOLE" in model]
ASK = """
import json, sys, mrcal, numpy as np
asked = json.load(sys.stdin)
points = np.array(asked["points"])
answer = {"projected": {m: mrcal.project(points, m, np.array(i)).tolist() for m, i in asked["models"].items()}}
answer["files"] = {}
for path in asked["files"]:
    model = mrcal.cameramodel(path)
    pixels = mrcal.project(points, *model.intrinsics())
    answer["files"][path] = [*model.intrinsics(), model.imagersize().tolist(), pixels]
print(json.dumps(answer, default=lambda array: array.tolist()))
"""
CAHVOR = """Dimensions = 1000 800
Model = CAHVOR = perspective, distortion
C = 1.0 2.0 3.0
A =    0.0998334166    0.0000000000    0.9950041653
H =  946.1384946930    0.0000000000  409.5907018190
V =   39.7836163580  901.5000000000  396.5091598440
O =    0.1096784327   -0.0199986667    0.9937659540
R =    0.0200000000   -0.0100000000    0.0030000000
"""


def ask_mrcal(models: dict[str, list[float]], files: list[str]) -> dict[str, dict[str, list]]:
    asked = json.dumps({"points": directions(35).tolist(), "models": models, "files": files})
    done = subprocess.run(["/usr/bin/python3", "-c", ASK], input=asked, capture_output=True, text=True, timeout=60)
    if done.returncode:
        if "ModuleNotFoundError" in done.stderr:
            pytest.skip("no mrcal in /usr/bin/python3")
        pytest.fail(done.stderr)
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def truth(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, list]]:
    """What mrcal says of all models, of files that we wrote, and of JPL's."""
    if not Path("/usr/bin/python3").exists():
        pytest.skip("no /usr/bin/python3")
    folder = tmp_path_factory.mktemp("mrcal")
    for model in EXACT:
        name = model.removeprefix("LENSMODEL_").lower()
        camera = Camera("a # \n é", name, np.array([1000 / 3, *CORE[1:], *MODELS[model]]), (1000, 800))
        MrcalCameraModel().write({"a": camera}, folder / f"{name}.cameramodel")
    (folder / "a.cahvor").write_text(CAHVOR)
    (folder / "straight.cahvor").write_text("\n".join(line for line in CAHVOR.splitlines() if line[0] != "O"))
    return ask_mrcal({m: [*CORE, *d] for m, d in MODELS.items()}, [str(path) for path in folder.iterdir()])


def read(path: Path, text: str) -> Imported:
    path.write_text(text)
    assert MrcalCameraModel().recognises(path)
    return MrcalCameraModel().read(path)["camera"]


def model_text(model: str, d: list[float], key: str = "lensmodel") -> str:
    return f"""# generated on a day
{{
    '{key}':  '{model}',

    # intrinsics are fx,fy,cx,cy,distortion0,distortion1,....
    'intrinsics': [ {", ".join(map(repr, CORE + d))},],
    'extrinsics': [ 0, 0.0, -1e-3, 1., 2, -3., ],
    'valid_intrinsics_region': [ [ 0, 0 ], [ 9, 9 ], ],
    'imagersize': [ 1000, 800,],
    'optimization_inputs': b'''a{{[("#b'''
}}
"""


@pytest.mark.parametrize("model", MODELS)
def test_every_model_projects_as_mrcal(model: str, truth: dict[str, dict[str, list]], tmp_path: Path) -> None:
    imported = read(tmp_path / "a.cameramodel", model_text(model, MODELS[model]))
    assert imported.image_size == (1000, 800)
    assert (imported.camera is not None) == (model in EXACT)
    agree(imported.project(directions(35)), np.array(truth["projected"][model]), 1e-8)
    if imported.camera is None:
        with pytest.raises(NotExactError, match="--fit MODEL"):
            exact(imported)


def test_mrcal_reads_what_we_write_and_jpls_files_as_we_do(truth: dict[str, dict[str, list]]) -> None:
    assert len(truth["files"]) == len(EXACT) + 2
    for name, (lensmodel, intrinsics, size, pixels) in truth["files"].items():
        path = Path(name)
        format_ = Cahvor() if path.suffix == ".cahvor" else MrcalCameraModel()
        assert format_.recognises(path)
        imported = format_.read(path)["camera"]
        assert list(imported.image_size or ()) == size == [1000, 800]
        agree(imported.project(directions(35)), np.array(pixels), 1e-6)
        if path.suffix == ".cameramodel":
            assert lensmodel == f"LENSMODEL_{path.stem.upper()}"
            assert exact(imported).params.tolist() == intrinsics


def test_older_spellings(tmp_path: Path) -> None:
    d = MODELS["LENSMODEL_OPENCV5"]
    new = exact(read(tmp_path / "a.cameramodel", model_text("LENSMODEL_OPENCV5", d)))
    assert exact(read(tmp_path / "a.cameramodel", model_text("DISTORTION_OPENCV5", d, "distortion_model"))) == new
    assert exact(read(tmp_path / "a.cameramodel", model_text("LENSMODEL_OPENCV5", d, "lens_model"))) == new


def test_cahvor_straight_ahead_is_exact(tmp_path: Path) -> None:
    d = [0.0, 0.0, 0.02, -0.01, 0.003]
    camera = exact(read(tmp_path / "a.cameramodel", model_text("LENSMODEL_CAHVOR", d)))
    assert camera.model == "opencv4"
    rays = directions(35)
    tangent2 = (rays[:, 0] ** 2 + rays[:, 1] ** 2) / rays[:, 2] ** 2
    scale = (1 + 0.02 - 0.01 * tangent2 + 0.003 * tangent2**2) / rays[:, 2]
    agree(camera.project(rays), rays[:, :2] * scale[:, None] * CORE[:2] + CORE[2:])
    path = tmp_path / "a.cahvor"  # O as A to the last digit that is written
    o = "O =    0.0998334166    0.0000000000    0.9950041653\n"
    path.write_text("".join(o if line[0] == "O" else line for line in CAHVOR.splitlines(keepends=True)))
    assert exact(Cahvor().read(path)["camera"]).model == "opencv4"


def test_fits(tmp_path: Path) -> None:
    bent = read(tmp_path / "a.cameramodel", model_text("LENSMODEL_CAHVOR", BENT))
    assert 1e-3 < fitted(bent, "opencv8").worst_px < 0.1
    with pytest.raises(
        NotExactError, match=r"pinhole does not fit: rms .* px, worst .* px over the image.*--accept-error"
    ):
        fitted(bent, "pinhole")
    wide = read(tmp_path / "a.cameramodel", model_text("LENSMODEL_STEREOGRAPHIC", []))
    assert fitted(wide, "opencv8").worst_px < 1e-3


def test_real_files(data_dir: Path) -> None:
    folder = data_dir / "formats" / "mrcal"
    camera = exact(MrcalCameraModel().read(folder / "cam0.opencv8.cameramodel")["camera"])
    assert (camera.model, camera.image_size, camera.params[0]) == ("opencv8", (4000, 2200), 1761.181055)
    pinhole = exact(MrcalCameraModel().read(folder / "pinhole-narrow-yawed-left.cameramodel")["camera"])
    assert pinhole.params.tolist() == [2405.678127, 2453.362582, 1508.569804, 978.395964]
    with pytest.raises(NotExactError, match=r"splined lens model.*cannot be fitted"):
        exact(MrcalCameraModel().read(folder / "cam0.splined.cameramodel")["camera"])
    jpl = exact(Cahvor().read(folder / "splined-0.scale0.6.cahvor")["camera"])
    assert jpl.image_size == (6016, 4016)
    np.testing.assert_allclose(jpl.params, [1211.374926, 1235.386348, 3017.639608, 1957.291928], rtol=1e-12)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (model_text("LENSMODEL_OPENCV6", []), "no lens model 'LENSMODEL_OPENCV6'"),
        (model_text("LENSMODEL_OPENCV8", [0.0]), "5 intrinsics, expected 12"),
        (model_text("LENSMODEL_CAHVORE_linearity=x", [0.0] * 8), "no linearity"),
        (
            model_text("LENSMODEL_PINHOLE", []).replace("900.5", "__import__('os')"),
            "not one|out of place|comma|bracket",
        ),
        (model_text("LENSMODEL_PINHOLE", []).replace("900.5", "nan"), "not a number"),
        (model_text("LENSMODEL_PINHOLE", []).replace("imagersize", "size"), "imagersize is missing"),
        (model_text("LENSMODEL_PINHOLE", [])[:-20], "not closed|not one whole Python literal"),
        ("{'lensmodel': " + "[" * 100_000, "nested more than 16 deep"),
        ("{'lensmodel': 1, 'lensmodel': 2}", "twice|not text"),
    ],
)
def test_refused(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "a.cameramodel"
    path.write_text(text)
    with pytest.raises(FileFormatError, match=message):
        MrcalCameraModel().read(path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("0.9950041653", "0.5"), "A is not a unit vector"),
        (("H =  946", "H = -946"), "x right, y down|not a unit"),
        (("V =   39.7836163580  901.5", "V =  939.7836163580  901.5"), "skew"),
        (("1000 800", "1000"), "expected 2"),
    ],
)
def test_jpl_files_refused(change: tuple[str, str], message: str, tmp_path: Path) -> None:
    path = tmp_path / "a.cahvor"
    path.write_text(CAHVOR.replace(*change))
    with pytest.raises(InputError, match=message):
        exact(Cahvor().read(path)["camera"])


def test_what_mrcal_has_no_model_for_is_not_written(tmp_path: Path) -> None:
    camera = Camera("a", "opencv_fisheye", np.array([*CORE, 0, 0, 0, 0.1]), (1000, 800))
    with pytest.raises(InputError, match="not opencv_fisheye"):
        MrcalCameraModel().write({"a": camera}, tmp_path / "a.cameramodel")
    tilted = Camera("a", "opencv14", np.array([*CORE, *np.zeros(13), 0.01]), (1000, 800))
    with pytest.raises(InputError, match=r"tau_y = 0.01 is in the way"):
        MrcalCameraModel().write({"a": tilted}, tmp_path / "a.cameramodel")
    untilted = Camera("a", "opencv14", np.array([*CORE, *np.zeros(11), 0.5, 0, 0]), (1000, 800))
    MrcalCameraModel().write({"a": untilted}, tmp_path / "a.cameramodel")
