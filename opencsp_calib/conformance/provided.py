"""Promises of everything that a plugin provides."""

import ast
import re
import sys
from collections.abc import Iterator
from functools import cache
from importlib.util import find_spec, resolve_name
from pathlib import Path

from opencsp_calib.conformance.kit import Setup, promise
from opencsp_calib.interfaces import Provided

__all__ = ["CHECKS"]

LIGHT = {"opencsp_calib", "numpy", "scipy", "pluggy", "typing_extensions", "yaml", "defusedxml", "tomli"}
"""What the core loads when plugins are listed, and parsers of text: quick to load and always there."""


def has_a_name_that_can_be_typed(provided: Provided, setup: Setup) -> None:
    """Lower-case letters, digits, hyphens and underscores, beginning with a letter."""
    promise(re.fullmatch(r"[a-z][a-z0-9_-]*", provided.name), f"{provided.name!r} cannot be typed as a name")


def says_what_is_missing(provided: Provided, setup: Setup) -> None:
    """None, or one line; the same when asked again."""
    missing = provided.missing()
    said = missing is None or (isinstance(missing, str) and missing.strip() and "\n" not in missing)
    promise(said, f"missing() must be None or one line that says what to install, not {missing!r}")
    promise(provided.missing() == missing, "missing() changes its mind when asked again")


def loads_no_vendor_when_listed(provided: Provided, setup: Setup) -> None:
    """What its module imports outside of functions is the standard library, the core's and its own package's."""
    module = type(provided).__module__
    if module.rpartition(".")[2].startswith("test_"):
        return  # written in a test, which may import what it likes
    vendors = sorted(_vendors(module, frozenset()))
    promise(not vendors, f"importing {module} imports {', '.join(vendors)}: do that inside functions")


CHECKS = (has_a_name_that_can_be_typed, says_what_is_missing, loads_no_vendor_when_listed)


def _vendors(module: str, seen: frozenset[str]) -> set[str]:
    """What a module, and what it imports of its own package, imports from elsewhere."""
    own = module.partition(".")[0]
    found: set[str] = set()
    for name in _imported(module):
        top = name.partition(".")[0]
        if top == own and name not in seen and name != module:
            found |= _vendors(name, seen | {module})
        elif top != own and top not in LIGHT and top not in sys.stdlib_module_names:
            found.add(top)
    return found


@cache
def _imported(module: str) -> frozenset[str]:
    """Modules that a module's source imports when it is imported, as dotted names; none where there is no source."""
    try:
        spec = find_spec(module)
    except (ImportError, ValueError):
        return frozenset()
    if spec is None or not spec.origin or not spec.origin.endswith(".py"):
        return frozenset()
    package = spec.name if spec.submodule_search_locations is not None else spec.parent
    tree = ast.parse(Path(spec.origin).read_text(encoding="utf-8"))
    return frozenset(name for statement in _executed(tree) for name in _names(statement, package or ""))


def _executed(node: ast.AST) -> Iterator[ast.AST]:
    """Everything below a node that runs on import: no function bodies, and nothing that only type checkers see."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            continue
        if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.dump(child.test):
            continue
        yield child
        yield from _executed(child)


def _names(statement: ast.AST, package: str) -> list[str]:
    if isinstance(statement, ast.Import):
        return [alias.name for alias in statement.names]
    if not isinstance(statement, ast.ImportFrom):
        return []
    origin = "." * statement.level + (statement.module or "")
    module = resolve_name(origin, package) if statement.level else origin
    if module.partition(".")[0] != package.partition(".")[0]:
        return [module]
    return [module, *(f"{module}.{alias.name}" for alias in statement.names)]  # a submodule, maybe
