"""Promises of a kind of board: its description and its board are the same thing, and so is what is printed."""

import numpy as np

from opencsp_calib.arrays import Floats, Mask
from opencsp_calib.board import CharucoBoard, Checkerboard
from opencsp_calib.conformance.kit import Setup, promise
from opencsp_calib.drawing import Drawing
from opencsp_calib.errors import BoardSpecError
from opencsp_calib.interfaces import BoardKind

__all__ = ["CHECKS"]

SPECS = {
    "checkerboard": ("checkerboard:7x5:30mm", "checkerboard:18x23:2in", "checkerboard:4x6:0.0123456789m"),
    "charuco": (
        "charuco:8x6:30mm:22mm:DICT_4X4_50",
        "charuco:5x7:4cm:25mm:DICT_5X5_100:inverted",
        "charuco:5x8:4cm:25mm:DICT_6X6_250:legacy",
    ),
}
BESIDE = 0.03  # of the spacing: next to a corner, inside of whatever meets there


def parses_its_own_descriptions(kind: BoardKind, setup: Setup) -> None:
    """A board's description makes the same board again, whatever its sizes are."""
    promise(kind.grammar.startswith(f"{kind.name}:"), f"its grammar {kind.grammar!r} does not begin with {kind.name}:")
    for spec in _specs(kind, setup):
        board = kind.parse(spec)
        promise(board.kind == kind.name, f"{spec} makes a board of kind {board.kind!r}")
        again = kind.parse(board.spec)
        promise(again.spec == board.spec, f"{spec} is described as {board.spec}, and that as {again.spec}")
        promise(np.array_equal(again.points, board.points), f"{board.spec} makes another board than {spec}")


def numbers_corners_row_by_row(kind: BoardKind, setup: Setup) -> None:
    """Flat, id 0 at the origin, columns fastest along x, rows along y, the spacing apart."""
    for spec in _specs(kind, setup):
        board = kind.parse(spec)
        points, spacing = board.points, board.spacing_m
        promise(len(points) >= 4 and not points[0].any(), f"{spec}: id 0 is at {points[0]}, expected the origin")
        promise(not points[:, 2].any(), f"{spec}: its nominal points are not at z = 0")
        promise(np.allclose(points[1], [spacing, 0.0, 0.0]), f"{spec}: id 1 is at {points[1]}, expected along x")
        along_y = points[board.grid[0]]
        promise(np.allclose(along_y, [0.0, spacing, 0.0]), f"{spec}: the second row begins at {along_y}")


def refuses_what_it_cannot_understand(kind: BoardKind, setup: Setup) -> None:
    """A wrong description is a BoardSpecError of one line that shows the grammar; nothing else is raised."""
    good = _specs(kind, setup)[0]
    fields = good.split(":")
    wrong = [kind.name, f"{kind.name}:", f"{kind.name}::::", f"{good}:surplus", f"{kind.name}:-3x5:30mm", "\x00"]
    wrong += [":".join([*fields[:n], "nonsense", *fields[n + 1 :]]) for n in range(1, len(fields))]
    wrong += [":".join([*fields[:n], "9" * 400, *fields[n + 1 :]]) for n in range(1, len(fields))]
    for spec in wrong:
        try:
            board = kind.parse(spec)
        except BoardSpecError as error:
            promise(kind.grammar in str(error), f"{spec[:40]!r}: the message does not show the grammar: {error}")
            promise("\n" not in str(error), f"{spec[:40]!r}: the message is not one line")
        except Exception as error:
            raise AssertionError(f"{spec[:40]!r} raises {error!r}, not a BoardSpecError") from error
        else:
            raise AssertionError(f"{spec[:40]!r} makes {board.spec}, but describes nothing")


def draws_its_corners_where_they_are(kind: BoardKind, setup: Setup) -> None:
    """Everything drawn is on the page, and something at every corner; of a checkerboard, four squares in turn."""
    for spec in _specs(kind, setup):
        board = kind.parse(spec)
        drawing = kind.draw(board)
        inside = all(
            min(r.x_m, r.y_m, r.width_m, r.height_m) >= -1e-12
            and r.x_m + r.width_m <= drawing.width_m * (1 + 1e-9)
            and r.y_m + r.height_m <= drawing.height_m * (1 + 1e-9)
            for r in drawing.rectangles
        )
        promise(drawing.rectangles and inside, f"{spec}: what it draws is not all on the page")
        corners = board.points[:, :2] + drawing.origin_m
        around = _around(drawing, corners, BESIDE * board.spacing_m)
        # a corner's edges meet next to it; a disc, whose middle counts, ends before the next one begins
        near = np.hstack([around, _around(drawing, corners, 0.5 * board.spacing_m)])
        met = ~(near == near[:, :1]).all(axis=1)
        promise(met.all(), f"{spec}: at {(~met).sum()} of {len(met)} corners nothing is drawn")
        if isinstance(board, Checkerboard | CharucoBoard):
            promise(
                _checked(around).all(), f"{spec}: {(~_checked(around)).sum()} corners are not where four squares meet"
            )
        if isinstance(board, Checkerboard):
            promise(around[0, 0] and around[0, 3], f"{spec}: the outer square at the corner with id 0 is not dark")


CHECKS = (
    parses_its_own_descriptions,
    numbers_corners_row_by_row,
    refuses_what_it_cannot_understand,
    draws_its_corners_where_they_are,
)


def _specs(kind: BoardKind, setup: Setup) -> tuple[str, ...]:
    specs = setup.specs or SPECS.get(kind.name, ())
    promise(specs, f"give descriptions that {kind.name!r} understands: parametrize_checks(kind, specs=[...])")
    return specs


def _around(drawing: Drawing, corners: Floats, beside_m: float) -> Mask:
    """(K, 4) whether it is dark to the upper left, upper right, lower left and lower right of each corner (K, 2)."""
    sides = beside_m * np.array([[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]])
    x, y = np.moveaxis(corners[:, None, :] + sides, 2, 0)
    dark = np.full(x.shape, drawing.dark)
    for r in drawing.rectangles:
        within = (x >= r.x_m) & (x < r.x_m + r.width_m) & (y >= r.y_m) & (y < r.y_m + r.height_m)
        dark[within] = not r.white
    return dark


def _checked(around: Mask) -> Mask:
    upper_left, upper_right, lower_left, lower_right = around.T
    return np.asarray((upper_left == lower_right) & (upper_right == lower_left) & (upper_left != upper_right))
