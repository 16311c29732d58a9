from __future__ import annotations

import struct

import pytest

from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition
from gatewayd.core.refusal import Reason, Refusal
from gatewayd.core.requester import Requester
from gatewayd.core.status import StatusBlock
from gatewayd.core.status_layout import (
    FIELDS,
    LENGTH,
    RELEASE,
    RELEASE_ALL,
    REQUEST,
    TABLES,
    StatusField,
    StatusTable,
)
from gatewayd.core.succession import succeed

PLC, HMI, AUX = range(3)
START, LAMP, PART, FORCE, SPEED, PATH, CYCLES = range(7)
ENTRIES: list[StatusField | StatusTable] = [*FIELDS, *TABLES]
OFFSETS = {entry.name: entry.offset for entry in ENTRIES}


@pytest.fixture
def status(cell: Cell) -> StatusBlock:
    return StatusBlock(cell)


def words(status: StatusBlock, name: str, now: float, count: int = 1) -> tuple[int, ...]:
    return struct.unpack(f">{count}H", status.read(OFFSETS[name], count, now))


def long(status: StatusBlock, name: str, now: float) -> int:
    (number,) = struct.unpack(">I", status.read(OFFSETS[name], 2, now))
    assert isinstance(number, int)
    return number


def test_any_part_is_a_slice_of_the_whole(cell: Cell, status: StatusBlock) -> None:
    cell.write(Requester(HMI), [Change(SPEED, 0.5)], 0.5)
    whole = status.read(0, LENGTH, 1.0)
    for first, count in (
        (0, 64),
        (3, 2),
        (30, 70),
        (63, 1),
        (64, 1),
        (190, 10),
        (1215, 2),
        (3300, 125),
        (4287, 1),
    ):
        assert status.read(first, count, 1.0) == whole[2 * first : 2 * (first + count)]


def test_the_header_tells_the_state(cell: Cell, status: StatusBlock) -> None:
    for now in (0.0, 0.05, 0.1):
        cell.tick(now)
    cell.health.frequency = 499.96
    assert words(status, "layout", 0.1) == (1,)
    assert long(status, "fingerprint", 0.1) == 0xC0FFEE42
    assert words(status, "heartbeat", 0.1, 4) == (2, 10, 3, 2)
    assert long(status, "robot_age", 0.1) == 100
    assert words(status, "frequency", 0.1) == (5000,)
    assert words(status, "sessions", 0.1) == (1,)


def test_the_appended_words_show_what_the_health_says(cell: Cell, status: StatusBlock) -> None:
    assert words(status, "unadopted", 0.0, 8) == (0,) * 8
    health = cell.health
    health.unadopted, health.differing, health.lag = 3, 2, 70.1234
    health.adoption, health.program, health.gaps = 4.2, 4, 2**16 + 1
    assert words(status, "unadopted", 0.0, 8) == (3, 2, 1, 4587, 5, 5, 1, 0)
    assert words(status, "refusal_reason", 0.0, 12) == (0, 0, 0, 0, 0xFFFF, 0xFFFF, 0, 0, 0, 0, 0, 0)
    health.program, health.adoption = 0, 1e9
    assert words(status, "adoption", 0.0, 2) == (0xFFFF, 1)


def test_the_numbers_of_links_lie_between_the_cores(cell: Cell) -> None:
    more = (StatusField(29, 1, "valve", ""), StatusField(60, 2, "shots", ""))
    status = StatusBlock(cell, (*more, *FIELDS))
    assert status.read(0, LENGTH, 1.0) == StatusBlock(cell).read(0, LENGTH, 1.0)
    cell.health.words.update(valve=7, shots=0x1_0002, unknown=3)
    assert struct.unpack(">HHH", status.read(28, 3, 1.0)) == (0, 7, 0)
    assert struct.unpack(">HHI", status.read(58, 4, 1.0)) == (0, 0, 0x1_0002)
    cell.health.words.update(valve=1 << 16, shots=1 << 40)
    assert struct.unpack(">H", status.read(29, 1, 1.0)) == (0xFFFF,)
    assert struct.unpack(">I", status.read(60, 2, 1.0)) == (0xFFFF_FFFF,)
    assert status.read(0, 28, 1.0) == StatusBlock(cell).read(0, 28, 1.0)


def test_flags_follow_the_state_bit_by_bit(cell: Cell, status: StatusBlock) -> None:
    assert words(status, "flags", 0.0) == (0b111,)
    cell.write(Requester(PLC), [Change(START, True)], 0.0)
    assert words(status, "flags", 0.0) == (0b1111,)
    cell.write(Requester(HMI), [Change(START, True)], 0.0)
    cell.health.read_back_mismatches = 1
    cell.health.watchdog_fed = True
    assert words(status, "flags", 0.0) == (0b1111111,)
    cell.robot_lost("unplugged", 0.0)
    assert words(status, "flags", 0.0) == (0b1111000,)


def test_before_anything_happened_ages_are_endless_and_nothing_was_refused(press: CellDefinition) -> None:
    status = StatusBlock(Cell(press))
    assert long(status, "robot_age", 1e6) == 0xFFFF_FFFF
    assert long(status, "uptime", 1e6) == 0
    assert words(status, "refusal_reason", 1e6, 6) == (0, 0, 0, 0, 0xFFFF, 0xFFFF)
    assert words(status, "age", 1e6, 10) == (0xFFFF,) * 10
    assert words(status, "quality", 1e6, 10) == (3,) * 10


def test_long_times_saturate_and_counters_wrap(cell: Cell, status: StatusBlock) -> None:
    cell.tick(0.0)
    cell.write(Requester(PLC), [Change(START, True)], 0.0)
    cell.health.packages = 2**32 + 5
    cell.health.sessions = 2**16 + 1
    assert long(status, "robot_age", 1e10) == 0xFFFF_FFFF
    assert words(status, "age", 100.0) == (0xFFFF,)
    assert long(status, "packages", 0.0) == 5
    assert words(status, "sessions", 0.0) == (1,)


def test_the_last_refusal_names_everybody_from_one(cell: Cell, status: StatusBlock) -> None:
    cell.write(Requester(HMI), [Change(PART, 1)], 1.0)
    cell.write(Requester(PLC), [Change(PART, 2)], 1.0)
    assert words(status, "refusal_reason", 1.25, 6) == (3, PART + 1, PLC + 1, HMI + 1, 0, 250)
    cell.refuse(Requester(None), Refusal(Reason.NO_SUCH_ADDRESS), 1.0)
    assert words(status, "refusal_reason", 1.25, 4) == (1, 0, 0, 0)


def test_owners_and_leases_stand_at_every_variable_of_a_group(cell: Cell, status: StatusBlock) -> None:
    cell.write(Requester(HMI), [Change(PATH, 1)], 1.0)
    cell.write(Requester(PLC), [Change(START, True)], 1.0)
    assert words(status, "owner", 1.5, 8) == (1, 0, 0, 0, 2, 2, 0, 0)
    assert words(status, "lease", 1.5, 8) == (0xFFFF, 0, 0, 0, 1500, 1500, 0, 0)


def test_good_bits_count_from_the_least_significant(cell: Cell, status: StatusBlock) -> None:
    cell.set_availability([START, CYCLES], False, "gone", 0.0)
    assert words(status, "good", 0.0, 2) == (0b11_1011_1110, 0)
    assert words(status, "quality", 0.0, 7) == (2, 0, 0, 0, 0, 0, 2)


def test_writers_alive(cell: Cell, status: StatusBlock) -> None:
    cell.writer_connected(Requester(HMI), 0.0)
    assert words(status, "writers_alive", 0.0, 4) == (0, 1, 0, 0)


def test_a_lock_is_taken_and_given_back_by_the_number_of_its_variable(status: StatusBlock) -> None:
    assert status.write(Requester(HMI), REQUEST, [SPEED + 1], 1.0) is None
    assert words(status, "owner", 1.0, 6)[4:] == (2, 2)
    assert status.write(Requester(HMI), REQUEST, [0, PATH + 1], 1.0) is None
    assert words(status, "owner", 1.0, 6)[4:] == (0, 0)
    assert words(status, "request", 1.0, 2) == (0, 0)


def test_requests_by_number_are_counted_and_a_release_of_all_is_none(cell: Cell, status: StatusBlock) -> None:
    """A reload that gives the numbers to others has to know whether anybody uses them."""
    assert status.write(Requester(HMI), RELEASE, [RELEASE_ALL], 1.0) is None
    assert cell.health.lock_requests == 0
    assert status.write(Requester(HMI), REQUEST, [PART + 1], 1.0) is None
    assert succeed(cell, cell.definition, 2.0).cell.health.lock_requests == 1


def test_release_all_gives_back_what_is_mine(cell: Cell, status: StatusBlock) -> None:
    cell.write(Requester(HMI), [Change(PART, 1), Change(SPEED, 0.5)], 1.0)
    cell.write(Requester(PLC), [Change(START, True)], 1.0)
    assert status.write(Requester(HMI), RELEASE, [RELEASE_ALL], 1.0) is None
    assert words(status, "owner", 1.0, 6) == (1, 0, 0, 0, 0, 0)


def test_zeros_ask_for_nothing(cell: Cell, status: StatusBlock) -> None:
    assert status.write(Requester(HMI), REQUEST, [0, 0], 1.0) is None
    assert cell.health.writes_refused == 0


@pytest.mark.parametrize(
    "writer, first, request_words, reason",
    [
        (None, REQUEST, [1], Reason.NOT_WRITABLE),
        (HMI, REQUEST - 1, [1], Reason.NOT_WRITABLE),
        (HMI, RELEASE, [1, 1], Reason.NOT_WRITABLE),
        (HMI, 0, [1], Reason.NOT_WRITABLE),
        (HMI, REQUEST, [11], Reason.OUT_OF_LIMITS),
        (HMI, REQUEST, [RELEASE_ALL], Reason.OUT_OF_LIMITS),
        (HMI, REQUEST, [3, 3], Reason.OUT_OF_LIMITS),
        (HMI, REQUEST, [3, RELEASE_ALL], Reason.OUT_OF_LIMITS),
        (HMI, REQUEST, [START + 1], Reason.NOT_WRITABLE),
        (HMI, REQUEST, [CYCLES + 1], Reason.NOT_WRITABLE),
        (HMI, RELEASE, [CYCLES + 1], Reason.NOT_WRITABLE),
    ],
)
def test_what_cannot_be_asked_is_refused_counted_and_changes_nothing(
    cell: Cell, writer: int | None, first: int, request_words: list[int], reason: Reason
) -> None:
    refusal = StatusBlock(cell).write(Requester(writer), first, request_words, 1.0)
    assert refusal is not None
    assert refusal.reason is reason
    assert cell.health.writes_refused == 1
    assert cell.ownership.owners == [None] * 5


@pytest.mark.parametrize("offset, word", [(REQUEST, PART + 1), (RELEASE, PART + 1), (RELEASE, RELEASE_ALL)])
def test_locks_move_for_nobody_that_is_not_heard(cell: Cell, offset: int, word: int) -> None:
    cell.request(Requester(HMI), PART, 0.5)
    refusal = StatusBlock(cell).write(Requester(HMI, trusted=False), offset, [word], 1.0)
    assert refusal is not None
    assert refusal.reason is Reason.HEARTBEAT_LOST
    assert cell.ownership.held_by(HMI) == [cell.definition.variables[PART].lock]


WRITABLE = "a writer may write 60040 and 60041, the requests for locks"


@pytest.mark.parametrize(
    "writer, first, asked, said",
    [
        (HMI, 0, [1], ("60000", WRITABLE)),
        (None, REQUEST, [1, 0], ("60040-60041", WRITABLE)),
        (HMI, REQUEST, [99], ("60040", "variables are 1 to 10, not 99")),
        (HMI, REQUEST, [3, 3], ("60040-60041", "one lock at a time")),
    ],
)
def test_what_is_refused_here_says_where(
    status: StatusBlock, writer: int | None, first: int, asked: list[int], said: tuple[str, str]
) -> None:
    refusal = status.write(Requester(writer), first, asked, 1.0)
    assert refusal is not None
    assert (refusal.request, refusal.hint) == (f"wrote the status block at {said[0]}", said[1])
