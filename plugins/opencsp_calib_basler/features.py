"""A camera's features by their standard names, whatever the camera's family calls them.

The standard is GenICam's SFNC. Cameras older than it (Basler's ace classic and scout, on GigE) say ``ExposureTimeAbs``
and ``GainRaw`` for its ``ExposureTime`` and ``Gain``. Either name is understood for either camera.
"""

from typing import Any

from opencsp_calib import InputError
from opencsp_calib_basler.sentences import sentence

__all__ = ["exists", "highest", "lowest", "read", "same_feature", "write"]

FAMILIES = (
    ("ExposureTime", "ExposureTimeAbs", "ExposureTimeRaw"),
    ("Gain", "GainAbs", "GainRaw"),
    ("AcquisitionFrameRate", "AcquisitionFrameRateAbs"),
    ("ResultingFrameRate", "ResultingFrameRateAbs", "BslResultingAcquisitionFrameRate"),
    ("BlackLevel", "BlackLevelAbs", "BlackLevelRaw"),
    ("TriggerDelay", "TriggerDelayAbs"),
    ("SensorWidth", "WidthMax"),
    ("SensorHeight", "HeightMax"),
)
WRITTEN_FIRST = {  # what must be so for a feature to be writable
    "ExposureTime": (("ExposureAuto", "Off"),),
    "Gain": (("GainAuto", "Off"),),
    "AcquisitionFrameRate": (("AcquisitionFrameRateEnable", "1"),),
}


def same_feature(one: str, other: str) -> bool:
    """Whether two names mean one feature, in the words of different families of cameras."""
    return one == other or any(one in family and other in family for family in FAMILIES)


def exists(nodes: Any, name: str) -> bool:
    """Whether the camera has the feature, under any of its names."""
    return _node(nodes, name) is not None


def read(nodes: Any, name: str) -> str:
    """The feature's value as text; empty where the camera does not have it. Exposure times are in microseconds."""
    from pypylon import genicam

    node = _node(nodes, name)
    if node is None or not genicam.IsReadable(node):
        return ""
    if node.GetNode().GetName() == "ExposureTimeRaw" and name != "ExposureTimeRaw":
        return f"{float(node.ToString()) * _time_base(nodes):g}"
    return str(node.ToString())


def lowest(nodes: Any, name: str) -> str:
    """The least value that a whole-number feature can have now."""
    return str(_node(nodes, name).GetMin())


def highest(nodes: Any, name: str) -> str:
    """The greatest value that a whole-number feature can have now."""
    return str(_node(nodes, name).GetMax())


def write(nodes: Any, name: str, value: str) -> str:
    """Set a feature, and what must be set for that; run it where it is a command.

    Returns
    -------
    str
        What was set, as ``ExposureTimeAbs = 5000``.

    Raises
    ------
    InputError
        If the camera does not have it, or does not take the value.
    """
    from pypylon import genicam

    node = _node(nodes, name)
    if node is None:
        raise InputError(f"the camera has no feature {name!r}; its features are listed in Basler's pylon Viewer")
    for first, needed in next((w for known, w in WRITTEN_FIRST.items() if same_feature(known, name)), ()):
        if exists(nodes, first) and genicam.IsWritable(_node(nodes, first)):
            _node(nodes, first).FromString(needed)
    own = node.GetNode().GetName()
    try:
        if node.GetNode().GetPrincipalInterfaceType() == genicam.intfICommand:
            node.Execute()
            return f"{own} run"
        node.FromString(_in_its_units(nodes, own, name, value))
        return f"{own} = {node.ToString()}"
    except genicam.GenericException as error:
        raise InputError(f"the camera does not take {name}={value}: {sentence(error)}") from None


def _in_its_units(nodes: Any, own: str, name: str, value: str) -> str:
    """Raw features are whole numbers; a raw exposure time counts the camera's time base."""
    if own == name or not own.endswith("Raw"):
        return value
    try:
        number = float(value)
    except ValueError:
        return value  # the camera will say what is wrong with it
    return str(round(number / (_time_base(nodes) if own == "ExposureTimeRaw" else 1.0)))


def _time_base(nodes: Any) -> float:
    base = nodes.GetNode("ExposureTimeBaseAbs")
    return float(base.ToString()) if _implemented(base) else 1.0


def _node(nodes: Any, name: str) -> Any:
    """The first of the names that mean this feature which the camera has, its own name first; else None."""
    family = next((names for names in FAMILIES if name in names), ())
    for candidate in (name, *(n for n in family if n != name)):
        node = nodes.GetNode(candidate)
        if _implemented(node):
            return node
    return None


def _implemented(node: Any) -> bool:
    from pypylon import genicam

    return node is not None and bool(genicam.IsImplemented(node))
