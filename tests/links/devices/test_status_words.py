"""How a device is at one moment, for the status block, the control interface and the picture."""

from __future__ import annotations

import pytest

from gatewayd.core.cell import Cell
from gatewayd.core.status import StatusBlock
from gatewayd.core.status_layout import LENGTH, LINK_TABLES
from gatewayd.links.contract import Level
from gatewayd.links.devices.status_words import MAX_DEVICES, STATUS_WORDS, DeviceFigures, DeviceState
from gatewayd.links.registry import status_fields, status_tables
from tests.links.devices.cells import planned


def figures(
    state: DeviceState = DeviceState.GOOD, reason: str = "", age: float | None = 0.02
) -> DeviceFigures:
    return DeviceFigures(
        state=state,
        reason=reason,
        round_trip=None if age is None else 0.0034,
        age=age,
        answers=0x1_0005,
        timeouts=2,
        errors=3,
        refused={2: 4, 11: 1, 99: 7},
        losses=6,
    )


def test_words_are_as_they_are_documented() -> None:
    words = dict(zip((name for name, _ in STATUS_WORDS), figures().words, strict=True))
    assert (words["state"], words["round_trip"], words["age"], words["answers"]) == (2, 34, 20, 5)
    assert (words["refused"], words["refused_02"], words["refused_0B"], words["losses"]) == (12, 4, 1, 6)


@pytest.mark.parametrize("age, word", [(None, 0xFFFF), (100.0, 0xFFFF), (-1.0, 0)])
def test_ages_saturate(age: float | None, word: int) -> None:
    assert figures(age=age).words[2] == word


def test_a_device_that_is_not_good_is_a_problem() -> None:
    found = figures(DeviceState.LOST, "no answer for 1 s").health("island", {"unit": 3})
    assert (found.level, found.problems) == (
        Level.BAD,
        ("device island is lost: no answer for 1 s; look at its power, its cable and its address",),
    )
    assert (found.figures["unit"], found.figures["up"], found.figures["exceptions"]) == (
        3, 0, {"02": 4, "0B": 1, "63": 7},
    )  # fmt: skip
    assert figures().health("island", {}).problems == ()


def test_the_status_block_has_each_device_at_its_place() -> None:
    cell = Cell(planned().cell)
    cell.health.tables["devices"] = {1: figures().words}
    block = StatusBlock(cell, status_fields(), status_tables())
    width = len(STATUS_WORDS)
    found = block.read(LINK_TABLES, 2 * width, 0.0)
    assert found[: 2 * width] == bytes(2 * width)
    assert list(memoryview(found)[2 * width :].cast("B")[:2]) == [0, 2]
    assert LINK_TABLES + MAX_DEVICES * width == LENGTH
    assert StatusBlock(cell, status_fields()).read(LINK_TABLES, width, 0.0) == bytes(2 * width)
