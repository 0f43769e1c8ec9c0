"""Plugins: found, left out when broken, refused when two have one name; with real modules in real entry points."""

import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from opencsp_calib import Checkerboard
from opencsp_calib.errors import BoardSpecError, MissingDependencyError, PluginError, PluginWarning
from opencsp_calib.registry import Registry, installed, load

GOOD = """
from opencsp_calib import Detection, hookimpl

class Blind:
    name = "{name}"
    feature = "own"
    def missing(self): return {missing!r}
    def supports(self, board): return True
    def detect(self, image, board): return Detection.nothing("blind")

@hookimpl
def detectors():
    yield Blind()
"""


@pytest.fixture
def plugin(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Writes a module and gives its entry point."""
    monkeypatch.syspath_prepend(tmp_path)

    def write(name: str, source: str) -> EntryPoint:
        (tmp_path / f"{name}.py").write_text(source)
        sys.modules.pop(name, None)
        return EntryPoint(name, name, "opencsp_calib")

    return write


def test_a_plugin_is_found_and_its_origin_known(plugin) -> None:
    registry = load([plugin("plug_a", GOOD.format(name="blind", missing=None))])
    assert registry.detector("blind").detect(None, None).reason == "blind"  # type: ignore[arg-type]
    assert registry.origins["detectors", "blind"] == "plug_a (plug_a)"


@pytest.mark.parametrize("source", ["import not_installed", "raise RuntimeError('bad day')", "this is no python"])
def test_a_plugin_that_fails_to_load_is_left_out_with_a_warning(plugin, source: str) -> None:
    points = [plugin("plug_broken", source), plugin("plug_b", GOOD.format(name="blind", missing=None))]
    with pytest.warns(PluginWarning, match="plug_broken"):
        registry = load(points)
    assert list(registry.detectors) == ["blind"]


def test_a_hook_that_fails_is_left_out_with_a_warning(plugin) -> None:
    source = "from opencsp_calib import hookimpl\n@hookimpl\ndef solvers():\n    raise OSError('gone')\n    yield"
    with pytest.warns(PluginWarning, match="gone"):
        assert not load([plugin("plug_c", source)]).solvers


def test_what_is_no_detector_is_left_out_with_a_warning(plugin) -> None:
    source = "from opencsp_calib import hookimpl\n@hookimpl\ndef detectors():\n    yield 7"
    with pytest.warns(PluginWarning, match="is none: 7"):
        assert not load([plugin("plug_d", source)]).detectors


def test_two_of_one_name_are_an_error_that_names_both(plugin) -> None:
    points = [plugin(name, GOOD.format(name="same", missing=None)) for name in ("plug_e", "plug_f")]
    with pytest.raises(PluginError, match=r"plug_e .* and plug_f"):
        load(points)


def test_what_is_missing_says_what_to_install(plugin) -> None:
    registry = load([plugin("plug_g", GOOD.format(name="poor", missing="pip install eyes"))])
    with pytest.raises(MissingDependencyError, match="pip install eyes"):
        registry.detector("poor")
    with pytest.raises(MissingDependencyError, match="pip install eyes"):
        registry.detector_for(Checkerboard(5, 4, 0.1))


def test_names_that_do_not_exist_list_those_that_do() -> None:
    registry = installed()
    with pytest.raises(PluginError, match=r"'magic'.*bundle.*opencv"):
        registry.solver("magic")
    with pytest.raises(BoardSpecError, match=r"checkerboard:COLUMNSxROWS:SIZE"):
        registry.board("18x23")
    empty = Registry({}, {}, {}, {}, {}, {})
    with pytest.raises(PluginError, match="no installed plugin has a detector"):
        empty.detector_for(Checkerboard(5, 4, 0.1))


def test_ours_are_installed_as_a_third_partys_would_be() -> None:
    registry = installed()
    assert {"checkerboard", "charuco"} <= set(registry.boards)
    assert {"checkerboard", "charuco", "opencsp"} <= set(registry.detectors)
    assert {"opencv", "bundle", "mrcal", "colmap"} <= set(registry.solvers)
    assert registry.detector_for(Checkerboard(5, 4, 0.1)).name == "checkerboard"
