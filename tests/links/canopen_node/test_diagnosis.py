from __future__ import annotations

from dataclasses import replace

import pytest

from gatewayd.canopen.interface import ControllerState, Interface
from gatewayd.links.canopen_node.diagnosis import Heard, absent, looked_at, traffic
from gatewayd.links.canopen_node.plan import CanopenPlan
from gatewayd.links.examination import Outcome
from gatewayd.mapping.loader import load

MAPPING = b"""\
gatewayd: 1
cell: press
robot: {host: 127.0.0.1}
canopen: {channel: can0, bitrate: 500000, node: 16}
variables: {mode: {robot: robot_mode, canopen: auto}}
"""


def plan() -> CanopenPlan:
    loaded = load(MAPPING, "a.yaml").plan
    assert loaded is not None
    return loaded.the(CanopenPlan)


WELL = Interface(
    3, is_can=True, up=True, carrier=True, controller=ControllerState.ACTIVE, bitrate=500_000, restart_ms=100
)


def looked(**changes: object) -> dict[str, tuple[Outcome, str]]:
    found = looked_at(replace(WELL, **changes), plan())  # type: ignore[arg-type]
    return {seen.check: (seen.outcome, seen.text) for seen in found}


def test_an_interface_as_it_should_be() -> None:
    assert looked() == {
        "interface": (Outcome.OK, "can0 is there"),
        "bus state": (Outcome.OK, "can0 is up"),
        "bit rate": (Outcome.OK, "500000 bit/s, as the mapping says"),
    }


@pytest.mark.parametrize(
    "changes, check, outcome, text",
    [
        ({"is_can": False}, "interface", Outcome.PROBLEM, "can0 is not a CAN interface"),
        ({"up": False}, "bus state", Outcome.PROBLEM, "can0 is down"),
        ({"carrier": False}, "bus state", Outcome.PROBLEM, "can0 is bus-off"),
        ({"controller": ControllerState.BUS_OFF}, "bus state", Outcome.PROBLEM, "can0 is bus-off"),
        (
            {"controller": ControllerState.PASSIVE, "tx_errors": 128, "rx_errors": 3},
            "bus state",
            Outcome.PROBLEM,
            "can0 is error-passive (transmit errors: 128, receive errors: 3)",
        ),
        ({"controller": ControllerState.WARNING}, "bus state", Outcome.WARNING, "can0 is error warning"),
        ({"controller": None}, "bus state", Outcome.OK, "can0 is up"),
        (
            {"bitrate": 250_000},
            "bit rate",
            Outcome.PROBLEM,
            "can0 runs at 250000 bit/s, the mapping says 500000",
        ),
        (
            {"bitrate": None, "controller": None},
            "bit rate",
            Outcome.NOTE,
            "can0 reports none: a virtual bus, or an adapter at a serial line, where slcand sets it",
        ),
        ({"restart_ms": 0}, "restart", Outcome.WARNING, "can0 stays off the bus after a bus-off"),
    ],
)
def test_each_fault_of_an_interface(
    changes: dict[str, object], check: str, outcome: Outcome, text: str
) -> None:
    assert looked(**changes)[check] == (outcome, text)


def test_an_adapter_that_was_never_set_up_is_one_finding_with_one_remedy() -> None:
    """As it is when it was plugged in: it has no bit rate, and cannot be brought up without one."""
    fresh = {
        "up": False,
        "carrier": False,
        "controller": ControllerState.STOPPED,
        "bitrate": None,
        "restart_ms": 0,
    }
    assert looked(**fresh) == {
        "interface": (Outcome.OK, "can0 is there"),
        "bus state": (Outcome.PROBLEM, "can0 is down, and no bit rate is set"),
    }
    (found,) = [seen for seen in looked_at(replace(WELL, **fresh), plan()) if seen.outcome.is_finding]  # type: ignore[arg-type]
    assert found.remedy.startswith("`ip link set can0 up type can bitrate 500000 restart-ms 100`")


def test_a_driver_that_does_not_say_when_it_restarts_is_no_finding() -> None:
    assert "restart" not in looked(restart_ms=None)


def test_an_absent_interface_says_what_there_is() -> None:
    assert absent("can7").outcome is Outcome.PROBLEM
    assert "`ip link show type can`" in absent("can7").remedy


@pytest.mark.parametrize("identifier", [0x710, 0x590, 0x090])
def test_another_node_with_the_node_id_is_heard(identifier: int) -> None:
    heard = Heard(1.5, 4, {identifier, 0x181})
    seen, clash = traffic(heard, plan(), served=False)
    assert seen.text == "4 frames in 1.5 s, 2 identifiers"
    assert (clash.check, clash.outcome) == ("node-ID", Outcome.PROBLEM)
    assert [found.check for found in traffic(heard, plan(), served=True)] == ["traffic"]


def test_a_silent_bus_is_worth_a_note() -> None:
    (found,) = traffic(Heard(1.5, 0, frozenset()), plan(), served=False)
    assert (found.outcome, found.text) == (
        Outcome.NOTE,
        "nothing in 1.5 s: no other node sends, or none is on",
    )
