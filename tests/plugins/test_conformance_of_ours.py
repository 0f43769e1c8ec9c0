"""Our own plugins keep the promises that the conformance kit asks of everybody's."""

from opencsp_calib.conformance import parametrize_checks
from opencsp_calib.registry import installed

REGISTRY = installed()


@parametrize_checks(*REGISTRY.solvers.values())
def test_solver(provided, check):
    check(provided)


@parametrize_checks(*REGISTRY.boards.values())
def test_board_kind(provided, check):
    check(provided)


@parametrize_checks(*REGISTRY.detectors.values())
def test_detector(provided, check):
    check(provided)


@parametrize_checks(*REGISTRY.camera_formats.values())
def test_camera_format(provided, check):
    check(provided)


@parametrize_checks(*REGISTRY.image_sources.values())
def test_image_source(provided, check):
    check(provided)
