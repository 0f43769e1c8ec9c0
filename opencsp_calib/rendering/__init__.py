"""Photographs of boards in worlds with known answers."""

from opencsp_calib.rendering.photograph import render
from opencsp_calib.rendering.scene import Exposure, Scene, Spot

__all__ = ["Exposure", "Scene", "Spot", "render"]
