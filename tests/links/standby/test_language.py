"""The section `standby`."""

from __future__ import annotations

import pytest

from gatewayd.links.standby.plan import StandbyPlan
from gatewayd.mapping.loader import load
from tests.links.standby.cells import TEXT, pair, planned


def test_plan() -> None:
    assert pair("{peer: '192.0.2.12:2930', listen: '192.0.2.11:2930', address: 192.0.2.50}") == StandbyPlan(
        (("192.0.2.12", 2930),), ("192.0.2.11", 2930), "192.0.2.50"
    )
    assert pair("{peer: '[fd00::2]:2930', address: 'fd00:0::9'}").address == "fd00::9"


def test_grace_is_how_long_adopted_inputs_wait() -> None:
    assert planned("{peer: '192.0.2.12:2930'}").cell.adopt_for == 10
    assert planned("{peer: '192.0.2.12:2930', grace: 3s}").cell.adopt_for == 3
    assert planned("{peer: '192.0.2.12:2930', grace: none}").cell.adopt_for is None


@pytest.mark.parametrize(
    "standby, text",
    [
        ("{peer: nobody}", "`nobody` is not a listen address"),
        ("{peer: []}", "the list is empty"),
        ("{peer: ['192.0.2.1:1', '192.0.2.2:1', '192.0.2.3:1']}", "`peer` has 3 addresses"),
        ("{peer: '192.0.2.12:2930', address: 192.0.2.0/24}", "`192.0.2.0/24` is not an IP address"),
        ("{address: 192.0.2.50}", "the section `standby` needs the key `peer`"),
    ],
)
def test_what_is_wrong_is_said(standby: str, text: str) -> None:
    assert [each.message for each in load(TEXT.format(standby=standby).encode(), "a.yaml").errors] == [text]


@pytest.mark.parametrize(
    "frequency, named",
    [
        (10, ["after a crash", "if the process hangs", "if the machine or its cable is gone"]),
        (1, ["after a crash", "if the process hangs", "if the machine or its cable is gone"]),
        (0.5, ["if the process hangs", "if the machine or its cable is gone"]),
        (0.25, ["if the machine or its cable is gone"]),
        (0.0625, []),
    ],
)
def test_takeovers_that_outlast_the_watchdog_of_the_robot_are_named(
    frequency: float, named: list[str]
) -> None:
    """It waits for two feeds, one of which may have been due when the gateway was lost: 1 / frequency at least."""
    text = TEXT.format(standby="{peer: '192.0.2.12:2930'}").replace(
        "{host: 127.0.0.1}",
        f"{{host: 127.0.0.1, watchdog: {{field: input_int_register_23, frequency: {frequency}}}}}",
    )
    found = load(text.encode(), "a.yaml")
    messages = [each.message for each in found.diagnostics if each.rule.id == "GW886"]
    cases = ["after a crash", "if the process hangs", "if the machine or its cable is gone"]
    assert [case for case in cases if any(case in message for message in messages)] == named
