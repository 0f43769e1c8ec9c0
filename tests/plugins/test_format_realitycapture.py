"""RealityCapture against its documented formula."""

from pathlib import Path

import numpy as np
import pytest
from format_truth import agree, directions, opencv, perspective
from opencsp_calib_formats.realitycapture import RealityCapture

from opencsp_calib import InputError
from opencsp_calib.errors import FileFormatError, NotExactError
from opencsp_calib.importing import exact

SIZE = (1000, 800)
K = (900.0, 900.0, 500 + 2.0 - 0.5, 400 - 3.0 - 0.5)


def xmp(element: bool = False, **values: object) -> str:
    fields = {"DistortionModel": "brown3", "FocalLength35mm": "32.4", "Skew": "0", "AspectRatio": "1"}
    fields |= {"PrincipalPointU": "0.002", "PrincipalPointV": "-0.003", "CalibrationPrior": "exact"}
    fields |= {"DistortionCoeficients": "-0.1 0.02 -0.003 0 0 0"} | {k: str(v) for k, v in values.items()}
    inside = fields.pop("DistortionCoeficients") if element else ""
    attributes = " ".join(f'xcr:{key}="{value}"' for key, value in fields.items() if value != "None")
    child = f"<xcr:DistortionCoeficients>{inside}</xcr:DistortionCoeficients>" if element else ""
    return (
        '<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">'
        f'<rdf:Description xmlns:xcr="http://www.capturingreality.com/ns/xcr/1.1#" {attributes}>{child}'
        "<xcr:Position>1 2 3</xcr:Position></rdf:Description></rdf:RDF></x:xmpmeta>"
    )


def read(tmp_path: Path, text: str):
    path = tmp_path / "photo.xmp"
    path.write_text(text)
    assert RealityCapture().recognises(path)
    return RealityCapture().read(path)["photo"]


def test_real_file(data_dir: Path) -> None:
    imported = RealityCapture().read(data_dir / "formats" / "realitycapture" / "brown3.xmp")["brown3"]
    with pytest.raises(InputError, match="--image-size"):
        exact(imported)
    camera = exact(imported.resize((6000, 4000)))
    f, u, v = 0.677125998 * 6000, -0.000464752782510192 * 6000, -0.000823593392050301 * 6000
    np.testing.assert_allclose(camera.params[:4], [f, f, 3000 + u - 0.5, 2000 + v - 0.5], rtol=1e-8)
    np.testing.assert_allclose(camera.params[4:], [-0.124217384759894, 0.107339706650415, 0, 0, -0.0104748224573926])
    assert [note.code for note in imported.notes] == ["unverified-convention"]
    assert "0.5 px" in imported.notes[0].message


@pytest.mark.parametrize("element", [False, True])
def test_brown3(tmp_path: Path, element: bool) -> None:
    camera = exact(read(tmp_path, xmp(element)).resize(SIZE))
    agree(camera.project(directions()), opencv(directions(), K, (-0.1, 0.02, 0, 0, -0.003)))


def test_portrait_is_scaled_by_its_height(tmp_path: Path) -> None:
    camera = exact(read(tmp_path, xmp()).resize((800, 1000)))
    np.testing.assert_allclose(camera.params[:4], [900, 900, 401.5, 496.5])


def test_tangential_terms_are_swapped_and_flagged(tmp_path: Path) -> None:
    d = "-0.1 0.02 -0.003 0 0.001 -0.002"
    imported = read(tmp_path, xmp(DistortionModel="brown3t2", DistortionCoeficients=d))
    agree(
        exact(imported.resize(SIZE)).project(directions()), opencv(directions(), K, (-0.1, 0.02, -2e-3, 1e-3, -0.003))
    )
    assert len(imported.notes) == 2


def test_brown4_is_exact_only_without_its_fourth_term(tmp_path: Path) -> None:
    d = "-0.1 0.02 -0.003 {} 0.001 -0.002"
    model = {"DistortionModel": "brown4t2"}
    assert exact(read(tmp_path, xmp(**model, DistortionCoeficients=d.format(0))).resize(SIZE)).model == "opencv5"
    imported = read(tmp_path, xmp(**model, DistortionCoeficients=d.format(0.01)))
    with pytest.raises(NotExactError, match=r"k4 = 0\.01"):
        exact(imported.resize(SIZE))
    x, y = perspective(directions())
    r = np.hypot(x, y)
    radial = 1 - 0.1 * r**2 + 0.02 * r**4 - 0.003 * r**6 + 0.01 * r**8
    u = x * radial + 2 * -2e-3 * x * y + 1e-3 * (r**2 + 2 * x**2)
    v = y * radial + 2 * 1e-3 * x * y - 2e-3 * (r**2 + 2 * y**2)
    agree(imported.resize(SIZE).project(directions()), np.column_stack([K[0] * u + K[2], K[1] * v + K[3]]))


@pytest.mark.parametrize(
    ("values", "named"),
    [
        ({"Skew": "0.1"}, "Skew"),
        ({"AspectRatio": "1.01"}, "AspectRatio"),
        ({"DistortionModel": "division"}, "division"),
        ({"DistortionModel": "rationalP2D1"}, "rationalP2D1"),
        ({"DistortionCoeficients": "-0.1 0.02 -0.003 0 0.1 0"}, "brown3"),
    ],
)
def test_what_is_in_the_way_is_named(tmp_path: Path, values: dict, named: str) -> None:
    with pytest.raises(NotExactError, match=named):
        exact(read(tmp_path, xmp(**values)).resize(SIZE))


def test_division_by_nothing_and_perspective_are_pinholes(tmp_path: Path) -> None:
    for model in ("division", "perspective"):
        imported = read(tmp_path, xmp(DistortionModel=model, DistortionCoeficients="0 0 0 0 0 0"))
        assert exact(imported.resize(SIZE)).model == "pinhole"


def test_a_prior_without_distortion_is_no_result(tmp_path: Path) -> None:
    d = "0 0 0 0 0 0"
    imported = read(tmp_path, xmp(CalibrationPrior="initial", DistortionCoeficients=d))
    assert imported.notes[-1].code == "not-a-result"


@pytest.mark.parametrize(
    "text",
    [
        xmp(FocalLength35mm="-1"),
        xmp(FocalLength35mm="None"),
        xmp(DistortionCoeficients="1 2 3"),
        xmp(DistortionCoeficients="None"),
        xmp().replace("<xcr:Position>", '<xcr:FocalLength35mm>7</xcr:FocalLength35mm><xcr:Position a="1">'),
    ],
)
def test_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(FileFormatError):
        read(tmp_path, text)
