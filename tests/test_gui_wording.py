"""Messages in the window: no option of the command line, which nobody can type there."""

import ast
import re
from pathlib import Path

import pytest

from opencsp_calib.gui.wording import worded

ROOT = Path(__file__).resolve().parents[1]
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]+")
NEVER_ON_THE_PAGE = {"--params", "--model", "--release"}  # said to the command line only


def messages(path: Path) -> list[str]:
    """What the errors that a file raises, and its notes to people, say."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    docstrings = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and isinstance(node.body[0], ast.Expr)
    }
    texts = [node for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)]
    return [str(text.value) for text in texts if id(text) not in docstrings and " " in str(text.value)]


def test_every_option_that_a_message_names_has_words_of_the_page() -> None:
    """Of all that the core and our plugins say; but for what one face says itself, and what to tell pip."""
    files = [*(ROOT / "opencsp_calib").rglob("*.py"), *(ROOT / "plugins").rglob("*.py")]
    files = [file for file in files if not {"cli", "gui", "available.py"} & set(file.parts)]
    said = [message for file in files for message in messages(file) if OPTION.search(message)]
    assert len(said) > 10
    left = {option for message in said for option in OPTION.findall(worded(message))}
    assert left <= NEVER_ON_THE_PAGE


@pytest.mark.parametrize(
    ("said", "shown"),
    [
        (
            "which format a.json should have cannot be told; add --to with one of colmap, kalibr",
            'which format a.json should have cannot be told; add "Format" under Convert with one of colmap, kalibr',
        ),
        (
            "the file has 2 cameras; choose one with --camera: a, b",
            'the file has 2 cameras; choose one with "Which of several cameras": a, b',
        ),
        ("--camera-like words and x--to stay", "--camera-like words and x--to stay"),
    ],
)
def test_words(said: str, shown: str) -> None:
    assert worded(said) == shown
