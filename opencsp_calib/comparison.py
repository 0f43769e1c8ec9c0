"""Temporary: becomes the module when its author has finished."""
from opencsp_calib.compare import Difference, compare
__all__=["Difference","compare"]
