"""The page of all studies, from what they found."""

import re
from pathlib import Path

__all__ = ["page"]

RESULTS = Path(__file__).resolve().parents[2] / "validation" / "results"
HEAD = "# The studies in full\n\nMade from `validation/results/`; [in short](validation.md).\n"


def page() -> str:
    """The page in Markdown: each result a section, its own headings one level down."""
    return "\n\n".join([HEAD, *(_section(result) for result in sorted(RESULTS.glob("*.md")))]) + "\n"


def _section(result: Path) -> str:
    text = re.sub(r"^#", "##", result.read_text(encoding="utf-8").strip(), flags=re.MULTILINE)
    # every page has figures, and a name for a link has to be one only
    return f"({result.stem.replace('_', '-')})=\n{text.replace('## Figures', f'## Figures of {result.stem}', 1)}"
