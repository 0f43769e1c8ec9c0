"""The renderer's loops: how much light each pixel gets from a pattern seen through a smooth map.

Nothing here is sampled at points: the part of a small cell that lies on either side of a straight edge is known in
closed form, so that edges are where they should be, however they run through the pixels.
"""

import math

import numpy as np

from opencsp_calib.arrays import Floats
from opencsp_calib.rendering.compiled import compiled

__all__ = ["light_of"]


@compiled
def light_of(
    places_x: Floats,
    places_y: Floats,
    step: int,
    inset: int,
    x_edges: Floats,
    y_edges: Floats,
    levels: Floats,
    sheet: Floats,
    light: Floats,
    behind: Floats,
    before: Floats,
    response: Floats,
) -> Floats:
    """The image of a pattern before noise.

    Parameters
    ----------
    places_x, places_y : (rows, columns) m
        Where on the pattern the nodes of a grid of pixels look, every `step` pixels.
    step : int
    inset : int
        Pixels from the first node to the first pixel wanted.
    x_edges, y_edges, sheet
        See `Pattern`.
    levels : (N, M)
        Grey level of each cell of the pattern in full light, 0 beside the sheet.
    light, behind, before : (height, width)
        Of each pixel wanted: the light that falls on the sheet, the grey level of what is behind it, and the grey
        level that is added whatever is there.
    response : (samples, samples, 2 m + 1, 2 m + 1)
        See `pixel_response`.

    Returns
    -------
    (height, width)
        Wrong within m pixels of the border, which does not see what is beyond it.
    """
    height, width = light.shape
    samples, reach = response.shape[0], response.shape[2] // 2
    plain = np.empty((height, width))
    seen = np.zeros((height, width))
    cell = np.empty((samples, samples))
    columns = places_x.shape[1] - 3
    px = np.empty((3, columns, 4))
    py = np.empty((3, columns, 4))
    x = np.empty(6)
    y = np.empty(6)
    last_x, last_y = len(x_edges) - 2, len(y_edges) - 2
    for row in range(height):
        _row_polynomials(places_x, row + inset, step, px)
        _row_polynomials(places_y, row + inset, step, py)
        i = j = 0
        for column in range(width):
            interval = (column + inset) // step
            t = (column + inset - interval * step) / step
            _taylor(px, interval - 1, t, step, x)
            _taylor(py, interval - 1, t, step, y)
            if math.isnan(x[0]) or math.isnan(y[0]):
                plain[row, column] = behind[row, column] + before[row, column]
                continue
            i = _cell_at(x_edges, x[0], i, last_x)
            j = _cell_at(y_edges, y[0], j, last_y)
            bright, back = light[row, column], behind[row, column]
            flat = levels[j, i] * bright + (1.0 - sheet[j, i]) * back
            plain[row, column] = flat + before[row, column]
            half_x = 0.5 * (abs(x[1]) + abs(x[2])) + 0.25 * (abs(x[3]) + abs(x[4]) + abs(x[5]))
            half_y = 0.5 * (abs(y[1]) + abs(y[2])) + 0.25 * (abs(y[3]) + abs(y[4]) + abs(y[5]))
            if (
                x[0] - half_x > x_edges[i]
                and x[0] + half_x < x_edges[i + 1]
                and y[0] - half_y > y_edges[j]
                and y[0] + half_y < y_edges[j + 1]
            ):
                continue
            _cells_of_pixel(x, y, i, j, x_edges, y_edges, levels, sheet, bright, back, cell)
            for b in range(samples):
                for a in range(samples):
                    cell[b, a] -= flat
            _spread(cell, response, seen, row, column, reach)
    _convolve(plain, response, seen, reach)
    return seen


@compiled
def _row_polynomials(places: Floats, row: int, step: int, out: Floats) -> None:
    """Cubics along a row of pixels: of the place, and of its first and second derivative across rows.

    Lagrange's through four nodes each way; `out` is (3, intervals, 4), powers of the fraction of the interval.
    """
    interval = row // step
    t = (row - interval * step) / step
    across = np.empty((3, 4))
    across[0, 0], across[0, 1] = -t * (t - 1) * (t - 2) / 6, (t + 1) * (t - 1) * (t - 2) / 2
    across[0, 2], across[0, 3] = -(t + 1) * t * (t - 2) / 2, (t + 1) * t * (t - 1) / 6
    across[1, 0], across[1, 1] = -(3 * t * t - 6 * t + 2) / 6, (3 * t * t - 4 * t - 1) / 2
    across[1, 2], across[1, 3] = -(3 * t * t - 2 * t - 2) / 2, (3 * t * t - 1) / 6
    across[2, 0], across[2, 1], across[2, 2], across[2, 3] = 1 - t, 3 * t - 2, 1 - 3 * t, t
    nodes = np.empty(4)
    for order in range(3):
        scale = 1.0 / step**order
        for column in range(out.shape[1]):
            for k in range(4):
                value = 0.0
                for m in range(4):
                    value += across[order, m] * places[interval - 1 + m, column + k]
                nodes[k] = value * scale
            n0, n1, n2, n3 = nodes[0], nodes[1], nodes[2], nodes[3]
            out[order, column, 0] = n1
            out[order, column, 1] = n2 - n0 / 3 - n1 / 2 - n3 / 6
            out[order, column, 2] = (n0 + n2) / 2 - n1
            out[order, column, 3] = (n1 - n2) / 2 + (n3 - n0) / 6


@compiled
def _taylor(cubics: Floats, interval: int, t: float, step: int, out: Floats) -> None:
    """Value, derivative by x and y, half the second derivatives by xx and yy, and the mixed one, a pixel as unit."""
    c, d, e = cubics[0, interval], cubics[1, interval], cubics[2, interval]
    out[0] = c[0] + t * (c[1] + t * (c[2] + t * c[3]))
    out[1] = (c[1] + t * (2 * c[2] + t * 3 * c[3])) / step
    out[2] = d[0] + t * (d[1] + t * (d[2] + t * d[3]))
    out[3] = (c[2] + t * 3 * c[3]) / (step * step)
    out[4] = 0.5 * (e[0] + t * (e[1] + t * (e[2] + t * e[3])))
    out[5] = (d[1] + t * (2 * d[2] + t * 3 * d[3])) / step


@compiled
def _cell_at(edges: Floats, place: float, start: int, last: int) -> int:
    """Which cell a place is in, from a guess that is nearly right."""
    at = start
    while at < last and place >= edges[at + 1]:
        at += 1
    while at > 0 and place < edges[at]:
        at -= 1
    return at


@compiled
def _cells_of_pixel(
    x: Floats,
    y: Floats,
    i: int,
    j: int,
    x_edges: Floats,
    y_edges: Floats,
    levels: Floats,
    sheet: Floats,
    bright: float,
    back: float,
    cell: Floats,
) -> None:
    """The mean light of each of the small cells of a pixel through which edges may run."""
    samples = cell.shape[0]
    last_x, last_y = len(x_edges) - 2, len(y_edges) - 2
    for b in range(samples):
        dy = (b + 0.5) / samples - 0.5
        for a in range(samples):
            dx = (a + 0.5) / samples - 0.5
            u = x[0] + dx * (x[1] + dx * x[3] + dy * x[5]) + dy * (x[2] + dy * x[4])
            v = y[0] + dx * (y[1] + dx * y[3] + dy * y[5]) + dy * (y[2] + dy * y[4])
            k, m = _cell_at(x_edges, u, i, last_x), _cell_at(y_edges, v, j, last_y)
            ux, uy, vx, vy = x[1] / samples, x[2] / samples, y[1] / samples, y[2] / samples
            near_u = min(u - x_edges[k], x_edges[k + 1] - u) < 0.5 * (abs(ux) + abs(uy))
            near_v = min(v - y_edges[m], y_edges[m + 1] - v) < 0.5 * (abs(vx) + abs(vy))
            if near_u and near_v:  # a corner of the pattern may be in the cell: cut it finer
                white = covered = 0.0
                for q in range(4):
                    for p in range(4):
                        fx, fy = (p - 1.5) / 4, (q - 1.5) / 4
                        w, s = _mixed(
                            u + fx * ux + fy * uy, v + fx * vx + fy * vy, ux / 4, uy / 4, vx / 4, vy / 4,
                            k, m, x_edges, y_edges, levels, sheet,
                        )  # fmt: skip
                        white += w / 16
                        covered += s / 16
            elif near_u or near_v:
                white, covered = _mixed(u, v, ux, uy, vx, vy, k, m, x_edges, y_edges, levels, sheet)
            else:
                white, covered = levels[m, k], sheet[m, k]
            cell[b, a] = white * bright + (1.0 - covered) * back


@compiled
def _mixed(
    u: float,
    v: float,
    ux: float,
    uy: float,
    vx: float,
    vy: float,
    i: int,
    j: int,
    x_edges: Floats,
    y_edges: Floats,
    levels: Floats,
    sheet: Floats,
) -> tuple[float, float]:
    """Mean level and sheet over a cell around (u, v), from the four pattern cells about the nearest edges."""
    i = _cell_at(x_edges, u, i, len(x_edges) - 2)
    j = _cell_at(y_edges, v, j, len(y_edges) - 2)
    edge_i = i if u - x_edges[i] < x_edges[i + 1] - u else i + 1
    edge_j = j if v - y_edges[j] < y_edges[j + 1] - v else j + 1
    right = _part_beyond(u - x_edges[edge_i], abs(ux), abs(uy))
    below = _part_beyond(v - y_edges[edge_j], abs(vx), abs(vy))
    i0, i1 = max(edge_i - 1, 0), min(edge_i, len(x_edges) - 2)
    j0, j1 = max(edge_j - 1, 0), min(edge_j, len(y_edges) - 2)
    w00, w01 = (1 - below) * (1 - right), (1 - below) * right
    w10, w11 = below * (1 - right), below * right
    level = w00 * levels[j0, i0] + w01 * levels[j0, i1] + w10 * levels[j1, i0] + w11 * levels[j1, i1]
    covered = w00 * sheet[j0, i0] + w01 * sheet[j0, i1] + w10 * sheet[j1, i0] + w11 * sheet[j1, i1]
    return level, covered


@compiled
def _part_beyond(distance: float, width_x: float, width_y: float) -> float:
    """The part of a square that lies beyond a straight edge.

    That is the chance that ``distance + X + Y > 0`` for X and Y evenly spread over their widths.
    """
    wide, narrow = max(width_x, width_y), min(width_x, width_y)
    d = abs(distance)
    if d >= 0.5 * (wide + narrow):
        part = 1.0
    elif d <= 0.5 * (wide - narrow):
        part = 0.5 + d / wide
    else:
        part = 1.0 - (0.5 * (wide + narrow) - d) ** 2 / (2.0 * wide * narrow)
    return part if distance > 0 else 1.0 - part


@compiled
def _spread(cell: Floats, response: Floats, out: Floats, row: int, column: int, reach: int) -> None:
    """Add what the small cells of a pixel give to the pixels around it."""
    height, width = out.shape
    if row < reach or column < reach or row >= height - reach or column >= width - reach:
        return
    size = 2 * reach + 1
    total = np.zeros((size, size))
    for b in range(cell.shape[0]):
        for a in range(cell.shape[1]):
            value = cell[b, a]
            if value != 0.0:
                weights = response[b, a]
                for n in range(size):
                    for m in range(size):
                        total[n, m] += value * weights[n, m]
    for n in range(size):
        for m in range(size):
            out[row - reach + n, column - reach + m] += total[n, m]


@compiled
def _convolve(plain: Floats, response: Floats, out: Floats, reach: int) -> None:
    """Add what pixels of one level each give to the pixels around them."""
    height, width = plain.shape
    size = 2 * reach + 1
    whole = np.zeros((size, size))
    for b in range(response.shape[0]):
        for a in range(response.shape[1]):
            whole += response[b, a]
    for row in range(reach, height - reach):
        line = out[row]
        for n in range(size):
            source = plain[row + reach - n]
            for m in range(size):
                weight = whole[n, m]
                for column in range(reach, width - reach):
                    line[column] += weight * source[column + reach - m]
