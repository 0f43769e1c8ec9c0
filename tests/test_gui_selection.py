"""Photographs on their way to the window: a batch is over once, whatever still comes of it."""

from pathlib import Path

import pytest

from opencsp_calib.gui.selection import Selection


@pytest.fixture
def selection(tmp_path: Path) -> Selection:
    return Selection(tmp_path, tmp_path / "uploads")


def test_a_batch_is_over_with_its_last_photograph_in_whatever_order_its_news_come(selection: Selection) -> None:
    """Photographs come by other connections than the word that they are about to."""
    assert not selection.received("batch", 2)
    selection.begin("batch", 2)
    assert selection.receiving == {"batch": (1, 2)}
    assert selection.received("batch", 2)
    assert selection.end("batch")
    assert not selection.receiving


def test_nothing_opens_a_batch_again_whose_page_is_gone(selection: Selection) -> None:
    """One photograph was still being kept then; an open batch would keep the next step from everybody for good."""
    selection.begin("batch", 3)
    selection.received("batch", 3)
    assert selection.end("batch")
    assert not selection.received("batch", 3)
    selection.begin("batch", 3)
    assert not selection.end("batch")
    assert not selection.receiving
