"""The report, where nothing else looks at it: a board that is not flat, very many residuals."""

import re
from dataclasses import replace

import pytest
from worlds import SmallWorld

from opencsp_calib import Observations, solve
from opencsp_calib.report import plots
from opencsp_calib.report.board_section import board_section
from opencsp_calib.report.plots import residual_plot
from opencsp_calib.synthetic import observe


def test_a_board_that_is_bowed_is_shown_with_its_heights() -> None:
    world = SmallWorld.seeded()
    points = world.board.points.copy()
    across = points[:, 0] / points[:, 0].max() - 0.5
    points[:, 2] = 0.002 * (1 - 4 * across**2)
    seen = observe(world.camera, world.board.with_points(points), world.poses, noise_px=0.02, rng=1)
    observations: Observations = replace(seen, board=world.board)
    section = board_section(solve(observations, board_shape="free"))
    assert "The board as solved" in section
    assert 'alt="heights and deviations of the board' in section
    found = re.search(r"([0-9.]+) mm \(over 0\.5 mm\)", section)
    assert found is not None
    assert abs(float(found[1]) - 2.0) < 0.1


def test_of_very_many_residuals_some_are_drawn_and_their_number_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    world = SmallWorld.seeded()
    calibration = solve(observe(world.camera, world.board, world.poses, noise_px=0.02, rng=1), board_shape="flat")
    corners = sum(map(len, calibration.residuals))
    assert "corners" not in residual_plot(calibration).axes[0].get_title()
    monkeypatch.setattr(plots, "MOST_ARROWS", 100)
    axes = residual_plot(calibration).axes[0]
    assert axes.get_title().endswith(f"; 100 of {corners} corners")
    assert len(axes.collections[0].get_offsets()) == 100
