"""Devices in the mapping language: what a file says, and the plans that it comes to."""

from __future__ import annotations

import pytest

from gatewayd.links.devices.expand import devices_of
from gatewayd.links.devices.plan import Sending
from gatewayd.mapping.rules.writers import is_supervised
from tests.links.devices.cells import HEAD, VARIABLES, device, loaded, planned

ONE = HEAD.replace("  gripper: {serial: /dev/ttyUSB0, baudrate: 115200, unit: 9, watchdog: 1s}\n", "")
FORCE = "  force: {robot: output_int_register_7, device: %s}\n"


def test_every_device_is_a_link_of_its_own() -> None:
    plan = planned()
    assert list(plan.links) == ["robot", "modbus", "island", "gripper"]
    assert plan.kinds == {"robot", "modbus", "device"}
    assert (device(plan, "island").writer, device(plan, "gripper").writer) == (0, None)


def test_what_is_written_of_an_output_says_when() -> None:
    plan = planned()
    names = [variable.name for variable in plan.cell.variables]
    assert device(plan, "island").sendings == (Sending(names.index("clamp")),)
    assert device(plan, "gripper").sendings == (
        Sending(names.index("force"), brings_up_to_date=True, every=1.0),
    )


@pytest.mark.parametrize("place", ["100", "{holding: 100}", "{at: island, holding: 100}", "[100]"])
def test_a_single_device_need_not_be_named(place: str) -> None:
    found = devices_of(loaded(FORCE % place, ONE).cell).places
    assert [(one.name, one.spec.selector, one.spec.address) for one in found] == [("island", "holding", 100)]


def test_an_input_need_not_be_shown_where_it_comes_from() -> None:
    written = """\
  level: {robot: input_int_register_3, device: {at: island, input: 4, type: uint16}, owner: island, on_release: -1}
  shared: {robot: input_int_register_4, device: {at: island, input: 5, type: uint16}, owner: island,
    on_release: -1, modbus: {holding: 10, type: int16}}
  back: {robot: output_int_register_5, device: {at: island, holding: 6, type: uint16}, limits: [0, 65535]}
"""
    shown = [variable.shown for variable in planned(written, ONE).cell.variables]
    assert shown == [None, (-32768, 32767), (0, 65535)]


def test_a_place_in_nothing_is_kept_for_the_rules() -> None:
    cell = loaded(FORCE % "{at: valve, holding: 100}").cell
    (place,) = devices_of(cell).places
    assert (place.name, place.device, place.where) == ("valve", None, None)
    assert not cell.is_complete


@pytest.mark.parametrize(
    "polls, lost_after",
    [
        ("poll: 20ms", 1.0),
        ("poll: 20ms, framing: rtu", 1.56),
        ("poll: 1s", 3.5),
        ("poll: 1s, timeout: 200ms", 3.2),
        ("lost_after: 400ms", 0.4),
    ],
)
def test_a_device_is_lost_after_three_polls(polls: str, lost_after: float) -> None:
    plan = planned(head=HEAD.replace("poll: 20ms", polls))
    assert device(plan, "island").lost_after == pytest.approx(lost_after)


def test_the_slowest_value_counts() -> None:
    plan = planned(VARIABLES.replace("discrete: 3", "discrete: 3, poll: 5s"))
    assert device(plan, "island").lost_after == 15.5


def test_a_device_is_supervised_whatever_its_writer_says() -> None:
    cell = loaded().cell
    assert is_supervised(cell.document.writers["island"].spec)


@pytest.mark.parametrize(
    "section, rule",
    [
        ("island: {unit: 1}", "missing-key"),
        ("island: {modbus: 127.0.0.1, serial: /dev/ttyS0}", "missing-key"),
        ("island: {modbus: 127.0.0.1, pol: 20ms}", "unknown-key"),
        ("island: {modbus: 127.0.0.1, unit: 256}", "out-of-range"),
        ("island:", "wrong-type"),
    ],
)
def test_findings_of_a_device_stand_at_its_place(section: str, rule: str) -> None:
    text = f"gatewayd: 1\ncell: press\nrobot: {{host: 127.0.0.1}}\ndevices:\n  {section}\nvariables:\n"
    found = loaded("  done: {robot: output_bit_register_0}\n", text).diagnostics
    assert (rule, 5) in [(each.rule.slug, each.position.line) for each in found]


def test_an_owner_that_is_none_of_the_writers_leaves_nobody() -> None:
    found = loaded(VARIABLES.replace("owner: island", "owner: islnad", 1))
    assert "`present` comes from `island`, but nobody may write it" in [one.message for one in found.errors]


def test_a_file_without_devices_is_not_judged_by_their_rules() -> None:
    """And its fingerprint is what it was: tests/golden has those of all shipped mappings."""
    text = "gatewayd: 1\ncell: press\nrobot: {host: 127.0.0.1}\nvariables:\n"
    plan = planned("  done: {robot: output_bit_register_0}\n", text)
    assert list(plan.links) == ["robot"]


@pytest.mark.parametrize("unit, is_right", [(0, False), (1, True), (247, True), (248, False)])
@pytest.mark.parametrize("line", ["serial: /dev/ttyUSB0, baudrate: 9600", "modbus: 127.0.0.1, framing: rtu"])
def test_a_unit_of_a_serial_line_has_an_address_that_it_answers_to(
    line: str, unit: int, is_right: bool
) -> None:
    head = HEAD.replace("serial: /dev/ttyUSB0, baudrate: 115200, unit: 9", f"{line}, unit: {unit}")
    messages = [error.message for error in loaded(head=head).errors if error.rule.id == "GW116"]
    assert messages == ([] if is_right else [f"a unit on a serial line is between 1 and 247, not {unit}"])


def test_a_lease_ends_between_two_polls() -> None:
    found = loaded(VARIABLES.replace("lease: 5s", "lease: 300ms")).diagnostics
    (said,) = (each for each in found if each.rule.id == "GW817")
    assert said.message == (
        "`speed` is lost after its lease of 300ms, but an answer of `island` may take 520ms with its poll"
    )


def test_a_fallback_that_the_register_of_an_input_does_not_have_is_no_trouble() -> None:
    """Nobody is shown an input by the device that it comes from."""
    plan = planned(
        VARIABLES.replace("type: uint16}, owner: [plc", "type: uint16}, on_release: -1, owner: [plc")
    )
    speed = next(variable for variable in plan.cell.variables if variable.name == "speed")
    assert speed.shown is None
