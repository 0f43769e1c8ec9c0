"""A page as PDF, in points of 1/72 inch.

Source: PDF 32000-1:2008, sections 7.5 (file structure), 8.5 (paths), 9.4 (text), 9.6.2.2 (the standard fonts), annex D
(the encoding of words, which is cp1252; other letters become question marks).
"""

from pathlib import Path

from opencsp_calib.drawing.page import Page
from opencsp_calib.errors import InputError

__all__ = ["write_pdf"]

POINTS = 72.0 / 0.0254
LARGEST_POINTS = 14400.0  # a side of a page, by annex C


def write_pdf(page: Page, path: Path) -> None:
    """Write a page of one leaf.

    Raises
    ------
    InputError
        If the page is larger than PDF allows.
    """
    width, height = page.width_m * POINTS, page.height_m * POINTS
    if max(width, height) > LARGEST_POINTS:
        raise InputError(f"a PDF page is at most {LARGEST_POINTS / POINTS:.2f} m long; write the board as .svg")
    content = _content(page, height)
    parts = [
        b"<</Type/Catalog/Pages 2 0 R>>",
        b"<</Type/Pages/Kids[3 0 R]/Count 1>>",
        b"<</Type/Page/Parent 2 0 R/MediaBox[0 0 %.5f %.5f]/Contents 4 0 R/Resources<</Font<</F 5 0 R>>>>>>"
        % (width, height),
        b"<</Length %d>>stream\n%b\nendstream" % (len(content), content),
        b"<</Type/Font/Subtype/Type1/BaseFont/Courier/Encoding/WinAnsiEncoding>>",
    ]
    file = b"%PDF-1.4\n"
    offsets = []
    for number, part in enumerate(parts, start=1):
        offsets.append(len(file))
        file += b"%d 0 obj\n%b\nendobj\n" % (number, part)
    table = b"".join(b"%010d 00000 n \n" % offset for offset in offsets)
    count = len(parts) + 1
    start = len(file)
    file += b"xref\n0 %d\n0000000000 65535 f \n%b" % (count, table)
    file += b"trailer<</Size %d/Root 1 0 R>>\nstartxref\n%d\n%%%%EOF\n" % (count, start)
    path.write_bytes(file)


def _content(page: Page, height: float) -> bytes:
    """Boxes filled all at once, then the lines; y counts from the foot of the page."""
    lines = [b"0 g"]
    for left, top, right, bottom in page.boxes * POINTS:
        lines.append(b"%.5f %.5f %.5f %.5f re" % (left, height - bottom, right - left, bottom - top))
    lines.append(b"f")
    for text in page.texts:
        words = text.words.encode("cp1252", "replace")
        for special in (b"\\", b"(", b")"):
            words = words.replace(special, b"\\" + special)
        place = (text.x_m * POINTS, height - text.y_m * POINTS)
        lines.append(b"BT/F %.5f Tf %.5f %.5f Td(%b)Tj ET" % (text.size_m * POINTS, *place, words))
    return b"\n".join(lines)
