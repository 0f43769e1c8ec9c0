"""What is known of each view before there is a calibration."""

from collections.abc import Mapping
from typing import Any

from opencsp_calib.detection import Observations
from opencsp_calib.initial import rough_tilts
from opencsp_calib.summary import observations_as_json

__all__ = ["described"]


def described(seen: Observations | None) -> dict[str, dict[str, Any]]:
    """Each view as `summary.view_as_json` tells it, by image, with a rough tilt; none where nothing was looked at."""
    tilts = rough_tilts(seen) if seen else {}
    found: list[Mapping[str, Any]] = observations_as_json(seen, {}, None)["views"] if seen else []
    return {view["image"]: {**view, "tilt_deg": tilts.get(view["image"])} for view in found}
