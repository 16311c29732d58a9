"""The file that says who served a cell last."""

from __future__ import annotations

from pathlib import Path

import pytest

from gatewayd.links.standby.served_mark import ServedMark


def test_it_is_kept_across_restarts(tmp_path: Path) -> None:
    state = tmp_path / "state"
    mark = ServedMark(state, "cell")
    assert not mark.read()
    mark.write(served_last=True)
    assert ServedMark(state, "cell").read()
    assert not ServedMark(state, "other").read()
    mark.write(served_last=False)
    assert not ServedMark(state, "cell").read()


def test_a_directory_that_cannot_be_written_is_reported_once(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    state = tmp_path / "state"
    state.write_text("no directory")
    mark = ServedMark(state, "cell")
    assert not mark.read()
    mark.write(served_last=True)
    mark.write(served_last=True)
    assert [record.message for record in caplog.records] == ["who served the cell last cannot be kept"]
