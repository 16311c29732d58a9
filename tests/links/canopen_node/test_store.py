"""The file behind a node's parameters. What it means for the node is shown in test_storage.py."""

from __future__ import annotations

import json
import threading
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.links.canopen_node.store import BackgroundStore, JsonStore, LssSettings, Saved, StoreError
from tests.links.canopen_node.recorder import until


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "press-3.json"


def test_an_edited_file_is_damaged(path: Path) -> None:
    JsonStore(path).save(Saved(values={(0x1017, 0): b"\x32\0"}))
    document = json.loads(path.read_text())
    document["values"]["1017:00"] = "3300"
    path.write_text(json.dumps(document))
    with pytest.raises(StoreError):
        JsonStore(path).load()


def test_the_directory_is_made_with_the_first_save(tmp_path: Path) -> None:
    """Nobody else makes ~/.local/state/gatewayd, and a master that saves would be told of a hardware error."""
    store = JsonStore(tmp_path / "state" / "gatewayd" / "press-3.json")
    assert store.load() == Saved()
    store.save(Saved(layout=7))
    assert store.load().layout == 7


@given(
    st.dictionaries(st.tuples(st.integers(0x1000, 0xFFFF), st.integers(0, 255)), st.binary(max_size=64)),
    st.integers(0, 2**32 - 1),
)
def test_any_content_comes_back(
    tmp_path_factory: pytest.TempPathFactory, values: dict[tuple[int, int], bytes], layout: int
) -> None:
    saved = Saved(layout, values, LssSettings(9, 255))
    store = JsonStore(tmp_path_factory.getbasetemp() / "any.json")
    store.save(saved)
    assert store.load() == saved


class SlowStore(BackgroundStore):
    """A disk that takes until the test lets it."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.begun = threading.Event()
        self.may_end = threading.Event()

    def save(self, saved: Saved) -> None:
        self.begun.set()
        assert self.may_end.wait(5.0)
        super().save(saved)


async def test_the_loop_goes_on_while_the_disk_writes(path: Path) -> None:
    store = SlowStore(path)
    ends: list[StoreError | None] = []
    saved = Saved(values={(0x1017, 0): b"\x32\0"})
    store.keep(saved, ends.append)
    await until(store.begun.is_set)
    assert store.busy
    assert store.load() == saved, "the node of a reload has what is being written"
    assert ends == []
    store.may_end.set()
    await until(lambda: ends == [None] and not store.busy)
    assert JsonStore(path).load() == saved


async def test_a_disk_that_fails_is_reported_in_the_end(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("where the directory should be")
    store = BackgroundStore(tmp_path / "file" / "file.json")
    ends: list[StoreError | None] = []
    store.keep(Saved(), ends.append)
    await until(lambda: ends)
    assert "cannot be written" in str(ends[0])
    assert not store.busy
