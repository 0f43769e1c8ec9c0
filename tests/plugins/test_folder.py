"""The folder source: images that are there, images that come while it looks, and files that are none."""

import shutil
import threading
import time
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from opencsp_calib_folder.source import FolderSource

from opencsp_calib import InputError
from opencsp_calib.conformance import Setup, checks_of
from opencsp_calib.images import write_image


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("incoming")
    for number in (1, 2, 10):
        write_image(np.full((6, 8), number, dtype=np.uint8), folder / f"img{number}.png")
    return folder


@pytest.mark.parametrize("check", checks_of(FolderSource()), ids=lambda check: check.name)
def test_conforms(folder, check):
    replace(check, setup=Setup(device=str(folder)))(FolderSource())


def levels(images):
    return [int(image.pixels[0, 0]) for image in images]


def test_what_is_there_comes_in_natural_order_and_it_ends_when_nothing_new_comes(folder):
    (folder / "notes.txt").write_text("no image")
    with FolderSource().open(str(folder), wait="0") as images:
        assert levels(images) == [1, 2, 10]


def test_a_folder_that_goes_away_says_so(tmp_path):
    folder = tmp_path / "drive"
    folder.mkdir()
    write_image(np.full((6, 8), 7, dtype=np.uint8), folder / "a.png")
    with FolderSource().open(str(folder), wait="300") as images:
        assert levels(islice(images, 1)) == [7]
        shutil.rmtree(folder)
        with pytest.raises(InputError, match=r"drive cannot be read any more: "):
            next(images)


def test_what_comes_while_it_looks_is_taken_once_whole(tmp_path, monkeypatch):
    monkeypatch.setattr("opencsp_calib_folder.source.GIVEN_UP_S", 300)  # however long the other program is kept waiting
    write_image(np.full((60, 80), 7, dtype=np.uint8), tmp_path / "other.png")
    data = (tmp_path / "other.png").read_bytes()

    def another_program():
        with (tmp_path / "slow.png").open("wb") as file:
            file.write(data[: len(data) // 2])
            file.flush()
            time.sleep(0.5)
            file.write(data[len(data) // 2 :])

    with FolderSource().open(str(tmp_path), wait=300) as images:
        assert levels(islice(images, 1)) == [7]
        writer = threading.Thread(target=another_program)
        writer.start()
        (image,) = islice(images, 1)
        writer.join()
    assert (image.name, image.size) == ("slow.png", (80, 60))


def test_a_file_that_is_no_image_is_left_out(tmp_path, monkeypatch, caplog):
    monkeypatch.setattr("opencsp_calib_folder.source.GIVEN_UP_S", 0.2)
    (tmp_path / "a.png").write_bytes(b"nonsense")
    with FolderSource().open(str(tmp_path), wait=0) as images:
        assert levels(images) == []
    assert "it is left out" in caplog.text


@pytest.mark.parametrize(
    ("device", "settings", "message"),
    [
        ("", {}, "no folder ''"),
        ("nowhere", {}, "no folder"),
        (".", {"gain": 1}, "no setting"),
        (".", {"wait": "x"}, "seconds"),
    ],
)
def test_what_cannot_be_opened_is_one_sentence(device, settings, message):
    with pytest.raises(InputError, match=message), FolderSource().open(device, **settings):
        pass
