"""Who may write, seen from two PLCs and from the robot: each refusal has its code, nothing is applied by half."""

from __future__ import annotations

import time

import pytest

from tests.e2e.plant import Plant
from tests.e2e.plc import BUSY, HMI, LINE, NO_ADDRESS, NO_VALUE, PLC, STRANGER, Plc
from tests.e2e.processes import Daemon, Simulator, wait_for

CELL = f"""\
writers:
  plc: {{modbus: {PLC}}}
  hmi: {{modbus: {HMI}}}
  line: {{modbus: {LINE}}}
groups:
  motion: {{owner: [plc, hmi], lease: 10s}}
variables:
  shared:  {{robot: input_int_register_0,    modbus: 0,    owner: any, lease: 1s}}
  ranked:  {{robot: input_int_register_1,    modbus: 2,    owner: [plc, hmi], lease: 30s}}
  first:   {{robot: input_int_register_2,    modbus: 4,    owner: [plc, hmi], lease: 30s, takeover: false}}
  go:      {{robot: input_bit_register_0,    modbus: 6.0,  group: motion}}
  target:  {{robot: input_int_register_3,    modbus: 7,    group: motion, on_release: hold}}
  speed:   {{robot: input_double_register_0, modbus: 9,    group: motion, on_release: 0.25}}
  limited: {{robot: input_int_register_4,    modbus: 13,   owner: plc, limits: [-5, 5], on_release: 3}}
  clamped: {{robot: input_double_register_1, modbus: 15,   owner: plc, limits: [0, 1], clamp: true}}
  plc_bit: {{robot: input_bit_register_32,   modbus: 20.0, owner: plc}}
  hmi_bit: {{robot: input_bit_register_33,   modbus: 20.1, owner: hmi}}
  echo:    {{robot: output_int_register_0,   modbus: 100}}
"""
SHARED, RANKED, FIRST, GO, TARGET, SPEED, LIMITED, CLAMPED, PLC_BIT, HMI_BIT, ECHO = range(1, 12)
NOBODY, THE_PLC, THE_HMI = 0, 1, 2
HELD, NOT_WRITABLE, OUT_OF_LIMITS, PARTIAL = 3, 2, 4, 5
"""Reasons as the status block numbers them."""

Cell = tuple[Simulator, Daemon, Plc, Plc]


@pytest.fixture
def cell(plant: Plant) -> Cell:
    simulator = plant.simulator()
    daemon = plant.daemon(plant.mapping(CELL, simulator.port))
    return simulator, daemon, plant.ready_plc(), plant.plc(HMI)


def test_second_writer_is_refused_and_accepted_after_the_lease(cell: Cell) -> None:
    simulator, daemon, plc, hmi = cell
    assert plc.write_integers(0, 11) == 0
    wait_for(lambda: plc.integers(100) == [11], "the robot's echo")
    assert plc.write_integers(0, 11) == 0
    assert hmi.write_integers(0, 22) == BUSY
    assert hmi.refusal == (HELD, SHARED, THE_HMI, THE_PLC)
    assert plc.owner(SHARED) == THE_PLC
    assert 0 < plc.lease(SHARED) <= 1000
    assert simulator.integer("input_int_register_0") == 11

    # Reading does not renew a lease; the fallback (clear) reaches the robot when it ends.
    lasted = wait_for(lambda: hmi.owner(SHARED) == NOBODY, "the lease to end")
    print(f"lease 1 s -> free: {lasted * 1000:.0f} ms")
    wait_for(lambda: simulator.integer("input_int_register_0") == 0, "the release fallback in the robot")
    assert hmi.write_integers(0, 22) == 0
    assert hmi.owner(SHARED) == THE_HMI
    wait_for(
        lambda: simulator.integer("input_int_register_0") == 22, "the second writer's value in the robot"
    )
    assert plc.write_integers(0, 33) == BUSY
    daemon.wait_for_line("write refused", "variable=shared", "writer=hmi", "holder=plc", "new=22")


def test_writing_renews_the_lease(cell: Cell) -> None:
    simulator, _daemon, plc, hmi = cell
    owners: set[int] = set()

    def refused_throughout() -> bool:
        assert plc.write_integers(0, 5) == 0
        owners.add(hmi.owner(SHARED))
        assert hmi.write_integers(0, 6) == BUSY
        return time.monotonic() - start > 1.6

    start = time.monotonic()
    wait_for(refused_throughout, "more than a lease to pass")
    assert owners == {THE_PLC}
    assert simulator.integer("input_int_register_0") == 5


def test_lock_is_requested_and_released_through_the_status_block(cell: Cell) -> None:
    simulator, daemon, plc, hmi = cell
    assert hmi.request(FIRST) == 0
    assert plc.owner(FIRST) == THE_HMI
    assert simulator.integer("input_int_register_2") == 0
    assert plc.request(FIRST) == BUSY
    assert plc.write_integers(4, 1) == BUSY
    assert plc.release(FIRST) == BUSY
    assert hmi.write_integers(4, 77) == 0
    wait_for(lambda: simulator.integer("input_int_register_2") == 77, "the value in the robot")
    assert hmi.release(FIRST) == 0
    assert plc.owner(FIRST) == NOBODY
    wait_for(lambda: simulator.integer("input_int_register_2") == 0, "the release fallback in the robot")
    assert plc.request(FIRST) == 0
    assert hmi.write_integers(4, 1) == BUSY
    assert plc.write_integers(13, 2) == 0
    assert plc.release(0xFFFF) == 0
    assert [plc.owner(FIRST), plc.owner(LIMITED)] == [NOBODY, NOBODY]
    assert plc.request(ECHO) == NO_ADDRESS
    assert plc.request(9999) == NO_VALUE
    assert "Traceback" not in daemon.text()


def test_higher_writer_takes_over(cell: Cell) -> None:
    simulator, daemon, plc, hmi = cell
    assert hmi.write_integers(2, 1) == 0
    assert plc.owner(RANKED) == THE_HMI
    assert plc.write_integers(2, 2) == 0
    assert plc.owner(RANKED) == THE_PLC
    assert hmi.write_integers(2, 3) == BUSY
    wait_for(lambda: simulator.integer("input_int_register_1") == 2, "the higher writer's value")
    daemon.wait_for_line("lock taken over", "lock=ranked", "writer=plc", "former=hmi")

    assert hmi.write_integers(4, 1) == 0
    assert plc.write_integers(4, 2) == BUSY, "this list is declared without takeover"


def test_group_has_one_owner_and_requests_are_all_or_nothing(cell: Cell) -> None:
    simulator, _daemon, plc, hmi = cell
    assert plc.write_doubles(9, 0.5) == 0
    assert [hmi.owner(number) for number in (GO, TARGET, SPEED)] == [THE_PLC] * 3
    assert hmi.write(6, [1]) == BUSY
    # One request over a free variable (first) and a held one (go, target): nothing of it is applied.
    assert hmi.write(4, [0, 9, 1, 0, 9]) == BUSY
    assert hmi.owner(FIRST) == NOBODY
    assert hmi.integers(4) == [0]
    assert plc.write(4, [0, 9, 1, 0, 9]) == 0
    wait_for(lambda: simulator.integer("input_int_register_3") == 9, "the group's values in the robot")
    assert simulator.integer("input_bit_registers0_to_31") == 1

    assert plc.release(GO) == 0
    wait_for(lambda: simulator.number("input_double_register_0") == 0.25, "each member's own fallback")
    assert simulator.integer("input_bit_registers0_to_31") == 0
    assert simulator.integer("input_int_register_3") == 9
    assert [hmi.owner(number) for number in (GO, TARGET, SPEED)] == [NOBODY] * 3


def test_limits_parts_outputs_and_strangers(cell: Cell, plant: Plant) -> None:
    simulator, daemon, plc, hmi = cell
    assert plc.write_integers(13, 5) == 0
    assert plc.write_integers(13, 6) == NO_VALUE
    assert plc.refusal[:3] == (OUT_OF_LIMITS, LIMITED, THE_PLC)
    assert plc.write_integers(13, -6) == NO_VALUE
    assert plc.write_one(13, 0) == NO_VALUE, "half of an INT32"
    assert plc.refusal[:2] == (PARTIAL, LIMITED)
    assert plc.write(14, [0, 0]) == NO_VALUE, "halves of two values"
    assert plc.write_integers(100, 1) == NO_ADDRESS, "an output"
    assert plc.refusal[:2] == (NOT_WRITABLE, ECHO)
    assert plc.write(50, [1]) == NO_ADDRESS, "nothing is mapped there"
    assert plc.write(60002, [1, 1]) == NO_ADDRESS, "of the status block only request and release"
    assert hmi.write_integers(13, 1) == NO_ADDRESS, "never writable by this writer"
    assert plc.reading_code(17, 8) == NO_ADDRESS, "a gap"
    assert plc.integers(13) == [5]
    assert plc.write_doubles(15, 7.5) == 0
    assert plc.doubles(15) == [1.0]
    wait_for(lambda: simulator.number("input_double_register_1") == 1.0, "the clamped value in the robot")

    stranger = plant.plc(STRANGER)
    assert stranger.integers(13) == [5]
    assert stranger.write_integers(13, 1) == NO_ADDRESS
    assert stranger.write_integers(13, 5) == NO_ADDRESS, "also what is there already"
    assert stranger.request(LIMITED) == NO_ADDRESS
    assert stranger.refusal[0] == NOT_WRITABLE
    daemon.wait_for_line("write refused", "writer=undeclared", f"peer={STRANGER}")
    assert simulator.integer("input_int_register_4") == 5


def test_two_writers_share_a_register_bit_by_bit(cell: Cell) -> None:
    """A whole-register write with the other's bit as it is goes through; one that would change it does not."""
    simulator, _daemon, plc, hmi = cell
    assert plc.write_one(20, 0b01) == 0
    assert hmi.write_one(20, 0b11) == 0
    assert [plc.owner(PLC_BIT), plc.owner(HMI_BIT)] == [THE_PLC, THE_HMI]
    wait_for(lambda: simulator.integer("input_bit_registers32_to_63") == 0b11, "both bits in the robot")
    assert plc.write_one(20, 0b01) == NO_ADDRESS
    assert hmi.write_one(20, 0b00) == NO_ADDRESS
    assert plc.write_one(20, 0b10) == 0
    wait_for(lambda: simulator.integer("input_bit_registers32_to_63") == 0b10, "the bit cleared by its owner")
