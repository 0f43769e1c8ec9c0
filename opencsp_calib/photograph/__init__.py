"""How good one photograph of a board is: its blur, its light, and what to do better."""

from opencsp_calib.photograph.blur import Blur, measured_blur
from opencsp_calib.photograph.light import Light, measured_light
from opencsp_calib.photograph.quality import PhotographQuality, measured, problems_of

__all__ = ["Blur", "Light", "PhotographQuality", "measured", "measured_blur", "measured_light", "problems_of"]
