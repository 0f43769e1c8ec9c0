"""The numbers that go into and come out of the kernel, and the room it works in."""

__all__ = [
    "COLUMNS", "CONVERGED", "DIAGNOSTICS", "FAILED", "LEVEL", "MOST_PIXELS", "OUTSIDE", "PARAMETERS", "RAMP_PX",
    "RESIDUAL", "ROOT", "SIDE", "X", "Y",
]  # fmt: skip

PARAMETERS = 11  # x, y, angle of edge 1, of edge 2, s, a, b, gradient of a in x and y, gradient of b
DIAGNOSTICS = 23
CONVERGED, OUTSIDE, FAILED = 0, 1, 2
RAMP_PX = 1.5  # over which a pixel's weight falls to nothing at the border of the window

# The table of a window's pixels: derivatives by each parameter, residual, x, y, grey level. The derivative by a is the
# root of the weight. The largest window, a parallelogram with sides of 2 * 14 + 1.5 px, holds fewer than 1088 pixels.
COLUMNS, MOST_PIXELS = 15, 1088
RESIDUAL, X, Y, LEVEL, ROOT = 11, 12, 13, 14, 5
SIDE = 64  # of the picture that residuals are laid out in, the corner in its middle
