"""The poll plan: what is read and written together, and what is not."""

from __future__ import annotations

import pytest

from gatewayd.links.exports import ExportError
from gatewayd.links.modbus_server.plc.model import Poll
from gatewayd.links.modbus_server.plc.polling import status_polls
from gatewayd.modbus.areas import Area
from tests.links.modbus_server.plc.cells import model


def ranges(polls: tuple[Poll, ...]) -> list[tuple[int, int, int]]:
    return [(poll.function, poll.address, poll.count) for poll in polls]


def test_neighbours_are_read_together_and_gaps_are_not() -> None:
    lines = (
        "a: {robot: output_int_register_0, modbus: 100}",
        "b: {robot: output_int_register_1, modbus: 102}",
        "c: {robot: output_int_register_2, modbus: 105}",
        "d: {robot: 'output_bit_register_0..3', modbus: {discrete: 8}}",
    )
    assert ranges(model(*lines).reads) == [(3, 100, 4), (3, 105, 2), (2, 8, 4)]
    filled = model(*lines, settings=", gaps: zero")
    assert ranges(filled.reads) == [(3, 100, 7), (2, 8, 4)]


def test_no_request_is_longer_than_the_protocol_allows() -> None:
    lines = (
        "a: {robot: 'output_double_register_0..23', modbus: 100}",
        "b: {robot: 'output_int_register_0..23', modbus: 196}",
    )
    assert ranges(model(*lines).reads) == [(3, 100, 124), (3, 224, 20)]


def test_what_is_held_back_does_not_hold_back_its_neighbours() -> None:
    lines = (
        "a: {robot: output_int_register_0, modbus: 100}",
        "b: {robot: output_int_register_1, modbus: 102, on_stale: exception}",
        "c: {robot: output_int_register_2, modbus: 104}",
    )
    assert ranges(model(*lines).reads) == [(3, 100, 2), (3, 102, 2), (3, 104, 2)]


def test_what_others_may_hold_is_written_on_demand() -> None:
    lines = (
        "a: {robot: input_int_register_0, modbus: 10, owner: plc}",
        "b: {robot: input_int_register_1, modbus: 12, owner: [plc, hmi]}",
        "c: {robot: input_int_register_2, modbus: 14, owner: [plc, hmi]}",
        "d: {robot: input_int_register_3, modbus: 16, owner: plc}",
    )
    polls = model(*lines).writes
    assert ranges(polls) == [(16, 10, 2), (16, 12, 2), (16, 14, 2), (16, 16, 2)]
    assert [poll.shared for poll in polls] == [False, True, True, False]


def test_a_register_of_several_writers_is_refused() -> None:
    lines = (
        "mine: {robot: input_bit_register_0, modbus: 0.0, owner: plc}",
        "theirs: {robot: input_bit_register_1, modbus: 0.1, owner: hmi}",
    )
    with pytest.raises(ExportError, match=r"register 0 holds `mine` beside `theirs`.*GW520"):
        model(*lines)


@pytest.mark.parametrize("variables, requests", [(1, 3), (976, 17), (977, 18), (1024, 20)])
def test_the_status_of_a_great_cell_needs_more_requests(variables: int, requests: int) -> None:
    polls = tuple(status_polls(variables))
    assert len(polls) == requests
    assert max(poll.count for poll in polls) <= 125
    assert sum(poll.count for poll in polls if "quality" in poll.what) == variables
    assert all(poll.area is Area.HOLDING for poll in polls)
