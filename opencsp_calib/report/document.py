"""One HTML file with everything in it: head, style, sections."""

import os
from collections.abc import Iterable
from html import escape
from importlib.resources import files

from opencsp_calib.atomic import replacing

__all__ = ["write_document"]


def write_document(title: str, sections: Iterable[str], path: str | os.PathLike[str]) -> None:
    """Write a page, aside and then in place.

    Parameters
    ----------
    title : str
    sections : iterable of str
        HTML; empty ones are passed over. Each is written before the next one is asked for: photographs take memory.
    path : path-like

    Raises
    ------
    InputError
        If it cannot be written.
    """
    style = files("opencsp_calib.report").joinpath("style.css").read_text(encoding="utf-8")
    head = (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title><style>{style}</style></head><body>\n"
    )
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8", errors="backslashreplace") as page:
        page.write(head)
        page.writelines(f"{section}\n" for section in sections if section)
        page.write("</body></html>\n")
