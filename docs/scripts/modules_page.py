"""The page of modules, from their own first lines."""

import ast
from pathlib import Path

__all__ = ["page"]

ROOT = Path(__file__).resolve().parents[2]
HEAD = """# What each module is

By its own first line. This page is made from the source when the documentation is built.
"""


def page() -> str:
    """The page in Markdown: the core, then each plugin."""
    packages = [ROOT / "opencsp_calib", *sorted((ROOT / "plugins").iterdir())]
    sections = [f"## {package.name}\n\n{_table(package)}" for package in packages if (package / "__init__.py").exists()]
    return "\n\n".join([HEAD, *sections]) + "\n"


def _table(package: Path) -> str:
    rows = [f"| `{_name(path, package)}` | {_first_line(path)} |" for path in sorted(package.rglob("*.py"))]
    return "\n".join(["| | |", "|---|---|", *rows])


def _name(path: Path, package: Path) -> str:
    return ".".join(path.relative_to(package.parent).with_suffix("").parts).removesuffix(".__init__")


def _first_line(path: Path) -> str:
    said = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    return said.partition("\n")[0].replace("|", "\\|")
