"""What a board looks like: as rectangles, and printed at true size."""

from opencsp_calib.drawing.shapes import Drawing, Rectangle, checkerboard_drawing

__all__ = ["Drawing", "Rectangle", "checkerboard_drawing"]
