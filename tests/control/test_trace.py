from __future__ import annotations

from dataclasses import replace

import pytest

from gatewayd.control.trace import MAX_BYTES, MAX_PASSAGES, MAX_TRACES, Row, Trace, Traces
from gatewayd.links.contract import Passage
from tests.control.served import FixedGateway
from tests.works import finished

MODBUS = ("", "modbus", "modbus")
ROBOT = ("press", "robot", "robot")


def passage(peer: str = "192.0.2.7:4000", cell: str | None = "press", size: int = 4) -> Passage:
    return Passage(1.0, bytes(size), False, peer, "192.0.2.1:502", cell)


def rows(trace: Trace, most: int = 100) -> list[Row]:
    found: list[Row] = finished(trace.rows(most, 100.0))
    return found


@pytest.mark.parametrize(
    "chosen, passes",
    [
        ({}, True),
        ({"cell": "press"}, True),
        ({"cell": "other"}, False),
        ({"link": "modbus"}, True),
        ({"link": "robot"}, False),
        ({"peer": "192.0.2.7"}, True),
        ({"peer": "192.0.2.7:4000"}, True),
        ({"peer": "192.0.2.70"}, False),
    ],
)
def test_filters(chosen: dict[str, str], passes: bool) -> None:
    trace = Trace(**chosen)
    trace.take(MODBUS, passage())
    assert bool(rows(trace)) is passes


def test_what_concerns_no_cell_is_in_the_trace_of_every_cell() -> None:
    """A unit that nobody serves: whoever looks for the mistake looks at his own cell."""
    trace = Trace("press")
    trace.take(MODBUS, passage(cell=None))
    assert rows(trace)[0]["cell"] is None


def test_what_passes_a_shared_line_is_found_by_the_names_of_its_links() -> None:
    devices = ("", "devices", "devices")
    for links, shown in ((("island",), "island"), (("island", "gripper"), "devices"), ((), "devices")):
        of_line = replace(passage(), links=links)
        for chosen in ("island", "devices", "gripper", "robot"):
            trace = Trace(link=chosen)
            trace.take(devices, of_line)
            found = rows(trace)
            assert bool(found) is (chosen == "devices" or chosen in links)
            assert all(row["link"] == shown for row in found)


def test_a_row_has_everything_raw() -> None:
    trace = Trace()
    trace.take(ROBOT, Passage(1.25, b"\1\2", True, "192.0.2.10:30004", "192.0.2.2:40000"))
    assert rows(trace) == [
        {
            "time": 101.25, "cell": "press", "link": "robot", "kind": "robot", "peer": "192.0.2.10:30004",
            "own": "192.0.2.2:40000", "out": True, "data": "0102",
        }
    ]  # fmt: skip


def test_what_nobody_reads_is_dropped_and_counted() -> None:
    trace = Trace()
    for _ in range(MAX_PASSAGES + 5):
        trace.take(MODBUS, passage())
    assert (trace.passed, trace.dropped) == (MAX_PASSAGES + 5, 5)
    large = Trace()
    for _ in range(10):
        large.take(MODBUS, passage(size=MAX_BYTES // 5))
    assert large.dropped == 5
    assert len(rows(large)) == 5
    large.take(MODBUS, passage())
    assert large.dropped == 5, "there is room again"


def test_taps_are_in_the_links_only_while_somebody_traces(gateway: FixedGateway) -> None:
    traces = Traces(gateway)
    first = traces.open({})
    second = traces.open({"link": "robot"})
    assert first is not None
    assert second is not None
    assert gateway.tap_of is not None
    tap = gateway.tap_of("press", "robot", "robot")
    assert gateway.tap_of("press", "robot", "robot") is tap
    tap(passage(cell=""))
    assert len(rows(first)) == len(rows(second)) == 1
    traces.close(first)
    assert gateway.tap_of is not None
    traces.close(second)
    traces.refresh()
    left: object = gateway.tap_of
    assert left is None


def test_there_are_few_at_a_time(gateway: FixedGateway) -> None:
    traces = Traces(gateway)
    assert None not in [traces.open({}) for _ in range(MAX_TRACES)]
    assert traces.open({}) is None


def test_a_misspelt_filter_is_said(gateway: FixedGateway) -> None:
    traces = Traces(gateway)
    assert traces.unknown({"link": "modbus"}) == ""
    assert traces.unknown({"link": "modbsu"}) == "there is no link modbsu, only modbus, robot"
    assert "there is no cell nowhere" in traces.unknown({"cell": "nowhere"})
