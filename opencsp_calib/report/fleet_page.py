"""The page of a fleet: a table of verdicts with links to each camera's own report."""

import os
from collections.abc import Sequence
from html import escape
from pathlib import Path
from urllib.parse import quote

from opencsp_calib.counted import counted
from opencsp_calib.fleet import REPORT_FILE, FleetResult
from opencsp_calib.judgement import judge
from opencsp_calib.report.document import write_document

__all__ = ["write_fleet"]

WORDS = {"good": "good", "doubt": "usable", "bad": "do not use", "failed": "failed"}
COLOURS = {"good": "good", "doubt": "doubt", "bad": "bad", "failed": "bad"}
CHANGES = {"unchanged": "good", "doubtful": "doubt", "changed": "bad"}
HEAD = ("camera", "verdict", "rms (px)", "images used", "focal length (px)", "since last time")


def write_fleet(results: Sequence[FleetResult], title: str, path: str | os.PathLike[str]) -> None:
    """Write the page of a fleet, one HTML file, aside and then in place.

    Parameters
    ----------
    results : sequence of FleetResult
    title : str
        What the fleet is called.
    path : path-like
        Its links to the cameras' reports are relative to where it is.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    counts = {word: sum(one.verdict == level for one in results) for level, word in WORDS.items()}
    said = ", ".join(f"{count} {word}" for word, count in counts.items() if count)
    level = "bad" if counts["failed"] or counts["do not use"] else "doubt" if counts["usable"] else "good"
    changed = [one.name for one in results if one.change and one.change.level == "changed"]
    verdict = f'<div class="verdict {level}">{counted(len(results), "camera")}: {said}.</div>'
    since = f"<p>Changed since last time: {escape(', '.join(changed))}.</p>" if changed else ""
    head = "".join(f"<th>{escape(name)}</th>" for name in HEAD)
    rows = "".join(_row(one, Path(path).parent) for one in results)
    table = f'<table class="fleet"><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>'
    notes = "".join(_notes(one) for one in results)
    sections = (f"<h1>{escape(title)}</h1>", verdict, since, table, notes)
    write_document(f"Fleet {title}", sections, path)


def _row(one: FleetResult, root: Path) -> str:
    found = one.calibration
    cells = [f'<td class="word {COLOURS[one.verdict]}">{WORDS[one.verdict]}</td>']
    if found is None:
        name = escape(one.name)
        cells += ["<td></td>"] * 3
    else:
        target = quote(Path(os.path.relpath(one.folder / REPORT_FILE, root)).as_posix())
        name = f'<a href="{target}">{escape(one.name)}</a>'
        cells += [
            f"<td>{found.rms_px:.4f}</td>",
            f"<td>{len(found.observations.used)} of {len(found.observations.views)}</td>",
            f"<td>{found.camera.params[0]:.2f} ± {found.sigma[0]:.2f}</td>",
        ]
    change = "" if one.change is None else escape(one.change.level)
    colour = "" if one.change is None else CHANGES[one.change.level]
    return f'<tr><td>{name}</td>{"".join(cells)}<td class="word {colour}">{change}</td></tr>'


def _notes(one: FleetResult) -> str:
    lines = [one.sentence] if one.verdict != "good" else []
    if one.calibration is not None and one.verdict != "good":
        lines += [problem.message for problem in judge(one.calibration)]
    if one.change is not None:
        lines.append(f"Since last time {one.change.level}: {one.change.sentence}.")
    items = "".join(f"<li>{escape(line)}</li>" for line in lines)
    return f"<h2>{escape(one.name)}</h2><ul>{items}</ul>" if items else ""
