"""What a person typed, on the command line or in the window, as values: an image size, a camera, notes, an aspect."""

from collections.abc import Iterable
from typing import cast

from opencsp_calib.camera import Camera
from opencsp_calib.errors import InputError
from opencsp_calib.models import lens_model
from opencsp_calib.options import PixelAspect

__all__ = ["aspect_from", "camera_from", "image_size_from", "notes_from"]


def aspect_from(text: str | None) -> PixelAspect | None:
    """The pixel aspect: free, square, or a number (fy/fx).

    Raises
    ------
    InputError
        If it is none of them.
    """
    if text is None or text in ("free", "square"):
        return cast("PixelAspect | None", text)
    try:
        return float(text)
    except ValueError:
        raise InputError(f"the pixel aspect is free, square or a number (fy/fx), not {text!r}") from None


def image_size_from(text: str | None) -> tuple[int, int] | None:
    """The width and height in WIDTHxHEIGHT.

    Raises
    ------
    InputError
        If it is written otherwise.
    """
    if text is None:
        return None
    width, x, height = text.lower().partition("x")
    if not (x and width.isdecimal() and height.isdecimal()):
        raise InputError(f"an image size is written as WIDTHxHEIGHT, such as 1626x1236, not {text!r}")
    return int(width), int(height)


def camera_from(params: str, model: str | None, image_size: str | None, name: str) -> Camera:
    """A camera of ``fx=..,fy=..,...`` for a lens model and an image size.

    Raises
    ------
    InputError
        If one of them is missing, or is none of the model's.
    """
    size = image_size_from(image_size)
    if model is None or size is None:
        raise InputError("--params needs --model and --image-size too")
    names = lens_model(model).parameter_names
    values = dict(_number(pair) for pair in params.split(","))
    missing, unknown = [n for n in names if n not in values], [n for n in values if n not in names]
    if missing or unknown:
        what = f"lacks {', '.join(missing)}" if missing else f"has {', '.join(unknown)}, which it should not"
        raise InputError(f"--params {what}; {model} has {', '.join(names)}")
    return Camera(name, model, [values[n] for n in names], size)  # type: ignore[arg-type]  # made an array there


def notes_from(pairs: Iterable[str]) -> dict[str, str]:
    """A camera's record: KEY=VALUE each.

    Raises
    ------
    InputError
        If one is not.
    """
    notes = {}
    for pair in pairs:
        key, equals, value = pair.partition("=")
        if not (equals and key.strip()):
            raise InputError(f"a note is written as KEY=VALUE, such as aperture=f/8, not {pair!r}")
        notes[key.strip()] = value.strip()
    return notes


def _number(pair: str) -> tuple[str, float]:
    name, _, value = pair.partition("=")
    try:
        return name.strip(), float(value)
    except ValueError:
        raise InputError(f"--params takes NAME=NUMBER, such as fx=2710.0, not {pair.strip()!r}") from None
