"""The lens models: how a point before the camera becomes a pixel, one formula a file.

To add one: write a file with a subclass of `LensModel` (`base.py` says what it owes), add an instance to
`LENS_MODELS` below; `tests/test_models.py` runs its checks on every model in that mapping.
"""

from collections.abc import Mapping
from types import MappingProxyType

from opencsp_calib.errors import InputError
from opencsp_calib.models.base import LensModel
from opencsp_calib.models.fisheye import FisheyeModel
from opencsp_calib.models.opencv import OpenCVModel

__all__ = ["LENS_MODELS", "OPENCV_MODELS", "LensModel", "lens_model"]

LENS_MODELS: Mapping[str, LensModel] = MappingProxyType(
    {
        model.name: model
        for model in (
            OpenCVModel("pinhole", 0),
            OpenCVModel("opencv4", 4),
            OpenCVModel("opencv5", 5),
            OpenCVModel("opencv8", 8),
            OpenCVModel("opencv12", 12),
            OpenCVModel("opencv14", 14),
            FisheyeModel(),
        )
    }
)
OPENCV_MODELS: Mapping[int, str] = MappingProxyType(
    {len(model.distortion_names): model.name for model in LENS_MODELS.values() if isinstance(model, OpenCVModel)}
)
"""The lens models of OpenCV's family by how many distortion coefficients they have: 0, 4, 5, 8, 12 or 14."""


def lens_model(name: str) -> LensModel:
    """The lens model of that name.

    Raises
    ------
    InputError
        If there is none; the message lists those there are.
    """
    try:
        return LENS_MODELS[name]
    except KeyError:
        raise InputError(f"no lens model is called {name!r}; there are {', '.join(LENS_MODELS)}") from None
