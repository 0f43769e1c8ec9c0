"""Which plugins are installed, and what they provide."""

import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from importlib.metadata import EntryPoint, entry_points
from typing import Any, TypeVar

import pluggy

from opencsp_calib import hookspecs
from opencsp_calib.board import Board
from opencsp_calib.errors import BoardSpecError, MissingDependencyError, PluginError, PluginWarning
from opencsp_calib.interfaces import BoardKind, CameraFormat, Detector, ImageSource, Provided, Solver

__all__ = ["Registry", "installed"]

T = TypeVar("T", bound=Provided)


@dataclass(frozen=True)
class Registry:
    """What the installed plugins provide, by name.

    Parameters
    ----------
    boards, detectors, solvers, camera_formats, image_sources : mapping of str to the object of that name
    origins : mapping of (str, str) to str
        For ``("solvers", "bundle")`` and the like, the plugin that provides it; a format's once it was asked for.
    """

    boards: Mapping[str, BoardKind]
    detectors: Mapping[str, Detector]
    solvers: Mapping[str, Solver]
    camera_formats: Mapping[str, CameraFormat]
    image_sources: Mapping[str, ImageSource]
    origins: Mapping[tuple[str, str], str]

    def detector(self, name: str) -> Detector:
        """The detector of that name, able to run; PluginError or MissingDependencyError otherwise."""
        return usable(self.detectors, name, "detector")

    def solver(self, name: str) -> Solver:
        """The solver of that name, able to run; PluginError or MissingDependencyError otherwise."""
        return usable(self.solvers, name, "solver")

    def image_source(self, name: str) -> ImageSource:
        """The image source of that name, able to run; PluginError or MissingDependencyError otherwise."""
        return usable(self.image_sources, name, "image source")

    def camera_format(self, name: str) -> CameraFormat:
        """The camera format of that name, able to run; PluginError or MissingDependencyError otherwise."""
        return usable(self.camera_formats, name, "camera format")

    def board_kind(self, name: str) -> BoardKind:
        """The kind of board of that name, able to run; PluginError or MissingDependencyError otherwise."""
        return usable(self.boards, name, "kind of board")

    def board(self, spec: str) -> Board:
        """The board of a one-line description; raises BoardSpecError."""
        kind = spec.partition(":")[0]
        if kind not in self.boards:
            grammars = " or ".join(board.grammar for board in self.boards.values())
            raise BoardSpecError(
                f"{spec!r} does not describe a board; write {grammars}, such as checkerboard:18x23:50mm, or the name "
                "of a board file (.json) or camera file (.h5)"
            )
        return self.boards[kind].parse(spec)

    def detector_for(self, board: Board) -> Detector:
        """The detector named as the board's kind, else the first by name that looks for such a board; able to run."""
        ordered = sorted(self.detectors.values(), key=lambda d: (d.name != board.kind, d.name))
        fitting = [d for d in ordered if d.supports(board)]
        able = [d for d in fitting if d.missing() is None]
        if able:
            return able[0]
        if fitting:
            raise MissingDependencyError(f"no detector for a {board.kind} can run here: {fitting[0].missing()}")
        raise PluginError(f"no installed plugin has a detector for a board of kind {board.kind!r}")


def usable(provided: Mapping[str, T], name: str, what: str) -> T:
    """The object of that name, able to run."""
    if name not in provided:
        raise PluginError(f"no {what} is called {name!r}; installed are: {', '.join(sorted(provided)) or 'none'}")
    missing = provided[name].missing()
    if missing:
        raise MissingDependencyError(f"the {what} {name!r} cannot run here: {missing}")
    return provided[name]


@cache
def installed() -> Registry:
    """What is installed in this environment; looked up once."""
    return load(entry_points(group=hookspecs.GROUP))


def load(points: Iterable[EntryPoint]) -> Registry:
    """A registry of the given entry points; one that fails to import is left out with a PluginWarning."""
    manager = pluggy.PluginManager(hookspecs.GROUP)
    manager.add_hookspecs(hookspecs)
    for point in sorted(points, key=lambda p: p.name):
        try:
            manager.register(point.load(), name=f"{point.name} ({point.value})")
        except Exception as error:  # a stranger's code: whatever it does must not stop ours
            message = f"plugin {point.name!r} ({point.value}) was left out, it cannot be loaded: {error!r}"
            warnings.warn(message, PluginWarning, stacklevel=2)
    origins: dict[tuple[str, str], str] = {}
    return Registry(
        boards=_collect(manager, "boards", BoardKind, "board kind", origins),
        detectors=_collect(manager, "detectors", Detector, "detector", origins),
        solvers=_collect(manager, "solvers", Solver, "solver", origins),
        camera_formats=_Later(lambda: _collect(manager, "camera_formats", CameraFormat, "camera format", origins)),
        image_sources=_collect(manager, "image_sources", ImageSource, "image source", origins),
        origins=origins,
    )


class _Later(Mapping[str, Any]):
    """Objects by name that are collected when first asked for: the formats are dozens of modules, seldom needed."""

    def __init__(self, collect: Callable[[], dict[str, Any]]) -> None:
        self._collect = collect

    @cached_property
    def _found(self) -> dict[str, Any]:
        return self._collect()

    def __getitem__(self, name: str) -> Any:
        return self._found[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._found)

    def __len__(self) -> int:
        return len(self._found)


def _collect(
    manager: pluggy.PluginManager, hook: str, contract: Any, what: str, origins: dict[tuple[str, str], str]
) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for implementation in getattr(manager.hook, hook).get_hookimpls():
        plugin = implementation.plugin_name
        try:
            objects = list(implementation.function())
        except Exception as error:  # a stranger's code, as above
            warnings.warn(f"plugin {plugin} was left out of the {hook}: {error!r}", PluginWarning, stacklevel=3)
            continue
        for provided in objects:
            if not isinstance(provided, contract):
                warnings.warn(f"plugin {plugin} gives a {what} that is none: {provided!r}", PluginWarning, stacklevel=3)
                continue
            if provided.name in found:
                both = f"{origins[hook, provided.name]} and {plugin}"
                raise PluginError(f"two plugins provide a {what} called {provided.name!r}: {both}; uninstall one")
            found[provided.name] = provided
            origins[hook, provided.name] = plugin
    return found
