"""A page as SVG, in millimetres."""

from html import escape
from pathlib import Path

from opencsp_calib.drawing.page import LETTER, Page

__all__ = ["write_svg"]


def write_svg(page: Page, path: Path) -> None:
    """Write a page whose black is one single shape, so that no viewer leaves hairlines between its parts."""
    width, height = page.width_m * 1e3, page.height_m * 1e3
    boxes = "".join(f"M{a:.6f} {b:.6f}H{c:.6f}V{d:.6f}H{a:.6f}Z" for a, b, c, d in page.boxes * 1e3)
    texts = "".join(
        f'<text x="{t.x_m * 1e3:.6f}" y="{t.y_m * 1e3:.6f}" font-family="monospace" font-size="{t.size_m * 1e3:.6f}" '
        f'textLength="{LETTER * t.size_m * 1e3 * len(t.words):.6f}">{escape(t.words)}</text>\n'
        for t in page.texts
    )
    path.write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.6f}mm" height="{height:.6f}mm" '
        f'viewBox="0 0 {width:.6f} {height:.6f}">\n'
        f'<rect width="100%" height="100%" fill="white"/>\n<path d="{boxes}"/>\n{texts}</svg>\n',
        encoding="utf-8",
    )
