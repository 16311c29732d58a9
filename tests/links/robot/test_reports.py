"""Lines of the log about a controller, with their fields."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from gatewayd.links.robot.reports import (
    LOSS_INTERVAL,
    ConnectionReports,
    report_kept,
    report_strange,
    report_text,
)
from gatewayd.rtde.messages import TextMessage
from gatewayd.rtde.strange import Oddity, StrangePackage
from tests.logs.written import Log, written_log


@pytest.fixture
def written(monkeypatch: pytest.MonkeyPatch) -> Iterator[Log]:
    with written_log(monkeypatch) as log:
        yield log


def test_a_connection_that_fails_for_the_same_reason_is_reported_once_in_a_while(written: Log) -> None:
    connection = ConnectionReports()
    for reason, now in (("refused", 0.0), ("refused", LOSS_INTERVAL - 1), ("timed out", LOSS_INTERVAL - 1)):
        connection.failed("press", "robot:30004", reason, now)
    assert connection.trouble == "timed out"
    connection.failed("press", "robot:30004", "timed out", 2 * LOSS_INTERVAL)
    connection.connected()
    assert not connection.trouble
    connection.failed("press", "robot:30004", "timed out", 2 * LOSS_INTERVAL)
    lines = written.lines()
    assert [line["reason"] for line in lines] == ["refused", "timed out", "timed out", "timed out"]
    assert {(line["event"], line["cell"], line["robot"]) for line in lines} == {
        ("no robot", "press", "robot:30004")
    }


def test_what_a_controller_says_and_sends_has_its_fields(written: Log) -> None:
    report_text("press", TextMessage("in use", "", 1))
    report_strange("press", StrangePackage(Oddity.UNKNOWN_TYPE, 200, "type 200", b"\1"))
    report_kept("press", "start, part")
    text, strange, kept = written.lines()
    assert (text["event"], text["text"]) == ("the controller says", "in use")
    assert (strange["event"], strange["kind"], strange["reason"]) == (
        "strange package",
        "unknown type",
        "type 200: 01",
    )
    assert (kept["event"], kept["variables"]) == ("the robot keeps what it holds", "start, part")
