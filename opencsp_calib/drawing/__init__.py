"""What a board looks like: as rectangles, and printed at true size."""

from opencsp_calib.drawing.shapes import Drawing, Rectangle, checkerboard_drawing
from opencsp_calib.drawing.writing import write_board

__all__ = ["Drawing", "Rectangle", "checkerboard_drawing", "write_board"]
