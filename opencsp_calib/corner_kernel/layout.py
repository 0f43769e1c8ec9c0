"""The numbers that go into and come out of the kernel, and the buffer it works in."""

__all__ = [
    "CONVERGED", "DIAGNOSTICS", "FAILED", "LEVEL", "OUTSIDE", "PARAMETERS", "PLACED", "RAMP_PX", "RESIDUAL", "ROOT",
    "SIDE", "STRIDE", "WORK_SIZE", "X", "Y",
]  # fmt: skip

PARAMETERS = 11  # x, y, angle of edge 1, of edge 2, s, a, b, gradient of a in x and y, gradient of b
DIAGNOSTICS = 23
CONVERGED, OUTSIDE, FAILED = 0, 1, 2
RAMP_PX = 1.5  # over which a pixel's weight falls to nothing at the border of the window

# Columns of the buffer: derivatives by each parameter, residual, x, y, grey level. The derivative by a is the root
# of the weight. The largest window, a parallelogram with sides of 2 * 14 + 1.5 px, holds fewer than 1088 pixels.
STRIDE = 1088
RESIDUAL, X, Y, LEVEL, ROOT = 11 * STRIDE, 12 * STRIDE, 13 * STRIDE, 14 * STRIDE, 5 * STRIDE
PLACED, SIDE = 15 * STRIDE, 64  # then residuals as a picture, the corner in its middle
WORK_SIZE = PLACED + SIDE * SIDE
