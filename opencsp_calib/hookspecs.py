"""How a plugin hands over what it provides: five hooks, plural nouns without arguments, yielding typed objects.

A plugin is a module named by an entry point in the group ``opencsp_calib``::

    # my_plugin.py
    from opencsp_calib import hookimpl

    @hookimpl
    def solvers():
        from my_plugin_solver import MySolver
        yield MySolver()

    # pyproject.toml
    [project.entry-points.opencsp_calib]
    mine = "my_plugin"
"""

from collections.abc import Iterable

import pluggy

from opencsp_calib.interfaces import BoardKind, CameraFormat, Detector, ImageSource, Solver

__all__ = ["GROUP", "boards", "camera_formats", "detectors", "hookimpl", "image_sources", "solvers"]

GROUP = "opencsp_calib"

hookspec = pluggy.HookspecMarker(GROUP)
hookimpl = pluggy.HookimplMarker(GROUP)


@hookspec
def boards() -> Iterable[BoardKind]:  # type: ignore[empty-body]
    """Kinds of calibration target.

    Example
    -------
    ::

        @hookimpl
        def boards():
            yield CheckerboardKind()
    """


@hookspec
def detectors() -> Iterable[Detector]:  # type: ignore[empty-body]
    """Finders of a board's corners.

    Example
    -------
    ::

        @hookimpl
        def detectors():
            yield CheckerboardDetector()
    """


@hookspec
def solvers() -> Iterable[Solver]:  # type: ignore[empty-body]
    """Engines that solve for the camera.

    Example
    -------
    ::

        @hookimpl
        def solvers():
            yield BundleSolver()
    """


@hookspec
def camera_formats() -> Iterable[CameraFormat]:  # type: ignore[empty-body]
    """Readers and writers of other programs' camera files.

    Example
    -------
    ::

        @hookimpl
        def camera_formats():
            yield ColmapText()
    """


@hookspec
def image_sources() -> Iterable[ImageSource]:  # type: ignore[empty-body]
    """Cameras and other things that deliver images.

    Example
    -------
    ::

        @hookimpl
        def image_sources():
            yield Folder()
    """
