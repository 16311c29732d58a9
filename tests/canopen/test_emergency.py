from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.canopen.dictionary import Abort, AbortCode
from gatewayd.canopen.emergency import (
    BURST,
    CAPACITY,
    HISTORY,
    IN_ORDER,
    RATE,
    Emergency,
    ErrorCode,
    Register,
    register_of,
)
from gatewayd.canopen.frame import Frame
from tests.links.canopen_node.wire import Client, Wire


class Errors:
    """EMCY of node 5 in a state that the test decides on."""

    def __init__(self) -> None:
        self.wire = Wire()
        self.allowed = True
        self.service = Emergency(self.wire.send, 5, lambda: self.allowed)
        self.client = Client(self.service.objects())


@pytest.fixture
def errors() -> Errors:
    return Errors()


def test_cct_emergency_01_message_register_and_history(errors: Errors) -> None:
    errors.service.raise_error(ErrorCode.HEARTBEAT, 0.0, b"\x01")
    assert errors.wire.take() == [Frame(0x85, bytes.fromhex("3081110100000000"))]
    assert errors.client.read(0x1001) == Register.GENERIC | Register.COMMUNICATION
    assert (errors.client.read(0x1003), errors.client.read(0x1003, 1)) == (1, 0x0001_8130)


def test_cct_emergency_02_reset_message_when_the_last_error_has_gone(errors: Errors) -> None:
    errors.service.raise_error(ErrorCode.HEARTBEAT, 0.0, instance=1)
    errors.service.raise_error(ErrorCode.HEARTBEAT, 0.0, instance=2)
    errors.wire.take()
    errors.service.clear(ErrorCode.HEARTBEAT, 1.0, instance=1)
    assert errors.wire.take() == []
    errors.service.clear(ErrorCode.HEARTBEAT, 1.0, instance=2)
    assert errors.wire.take() == [Frame(0x85, bytes(8))]
    assert errors.client.read(0x1001) == 0


def test_cct_emergency_03_history_is_newest_first_and_bounded(errors: Errors) -> None:
    for code in range(0x8101, 0x8101 + HISTORY + 2):
        errors.service.raise_error(code, 0.0)
    assert errors.client.read(0x1003) == HISTORY
    codes = [errors.client.read(0x1003, number) & 0xFFFF for number in range(1, HISTORY + 1)]
    assert codes == list(range(0x8102 + HISTORY, 0x8102, -1))


def test_cct_emergency_04_only_0_clears_the_history(errors: Errors) -> None:
    errors.service.raise_error(ErrorCode.HEARTBEAT, 0.0)
    errors.client.refused(0x1003, 0, 1, AbortCode.INVALID_VALUE)
    errors.client.write(0x1003, 0, 0)
    assert errors.client.read(0x1003) == 0
    with pytest.raises(Abort) as caught:
        errors.client.read(0x1003, 1)
    assert caught.value.code is AbortCode.NO_DATA


@pytest.mark.parametrize("value", [0x86, 0x0, 0x7F, 0x101, 0x2000_0085, 0x4000_0085, 0x885])
def test_cct_emergency_05_cob_id_changes_only_while_invalid(errors: Errors, value: int) -> None:
    errors.client.refused(0x1014, 0, value, AbortCode.INVALID_VALUE)
    errors.client.write(0x1014, 0, 0x8000_0085)
    errors.service.raise_error(ErrorCode.HEARTBEAT, 0.0)
    assert errors.wire.take() == []
    errors.client.refused(0x1014, 0, 0x101, AbortCode.INVALID_VALUE)
    errors.client.write(0x1014, 0, 0x190)
    errors.service.raise_error(ErrorCode.PASSIVE, 0.0)
    assert errors.wire.take()[0].can_id == 0x190


def test_cct_emergency_06_inhibit_time_in_100_us(errors: Errors) -> None:
    errors.client.write(0x1015, 0, 500)
    for code in (0x8101, 0x8102, 0x8103):
        errors.service.raise_error(code, 1.0)
    assert len(errors.wire.take()) == 1
    assert errors.service.next_deadline(1.0) == 1.05
    errors.service.tick(1.049)
    assert errors.wire.take() == []
    errors.service.tick(1.05)
    assert [frame.data[:2] for frame in errors.wire.take()] == [b"\x02\x81"]


def test_messages_wait_while_the_state_forbids_them(errors: Errors) -> None:
    errors.allowed = False
    errors.service.raise_error(ErrorCode.HEARTBEAT, 0.0)
    assert (errors.wire.take(), errors.service.next_deadline(0.0)) == ([], math.inf)
    errors.allowed = True
    errors.service.tick(1.0)
    assert len(errors.wire.take()) == 1


def test_raising_an_active_error_says_nothing_new(errors: Errors) -> None:
    for _ in range(3):
        errors.service.raise_error(ErrorCode.HEARTBEAT, 0.0)
    assert (len(errors.wire.take()), errors.client.read(0x1003)) == (1, 1)


def test_a_full_queue_forgets_the_oldest_message_and_counts_it(errors: Errors) -> None:
    errors.allowed = False
    for code in range(0x8100, 0x8100 + CAPACITY + 3):
        errors.service.raise_error(code, 0.0)
    errors.allowed = True
    errors.service.tick(0.0)
    frames = errors.wire.take()
    errors.service.tick((CAPACITY - BURST) / RATE)
    assert len(frames) == BURST
    assert frames[0].data[:2] == b"\x03\x81"
    assert len(errors.wire.take()) == CAPACITY - BURST


def test_an_error_that_comes_and_goes_is_sent_at_a_rate_and_its_last_state_in_any_case(
    errors: Errors,
) -> None:
    for number in range(200):
        now = number / 1000
        errors.service.tick(now)
        errors.service.raise_error(ErrorCode.WRITE_HELD, now, b"\x01", instance=1)
        errors.service.clear(ErrorCode.WRITE_HELD, now, instance=1)
    assert len(errors.wire.take()) <= BURST + RATE * 0.2 + 1
    while (due := errors.service.next_deadline(0.2)) < math.inf:
        errors.service.tick(due)
    frames = errors.wire.take()
    assert len(frames) <= IN_ORDER
    assert frames[-1].data == bytes(8)


def test_of_one_error_only_the_newest_messages_wait(errors: Errors) -> None:
    errors.allowed = False
    errors.service.raise_error(ErrorCode.PASSIVE, 0.0)
    for number in range(CAPACITY):
        errors.service.raise_error(ErrorCode.HEARTBEAT, 0.0, bytes([number]), instance=5)
        errors.service.clear(ErrorCode.HEARTBEAT, 0.0, instance=5)
    errors.allowed = True
    errors.service.clear(ErrorCode.PASSIVE, 0.0)
    frames = errors.wire.take()
    assert len(frames) <= IN_ORDER + 1
    assert frames[0].data[:2] == b"\x20\x81"
    assert frames[-1].data == bytes(8)


@pytest.mark.parametrize("forget, left", [(False, 1), (True, 0)])
def test_reset_ends_errors_and_reset_node_the_history_too(errors: Errors, forget: bool, left: int) -> None:
    errors.service.raise_error(ErrorCode.HEARTBEAT, 0.0)
    errors.service.restart(forget=forget)
    assert (errors.client.read(0x1001), errors.client.read(0x1003)) == (0, left)


@pytest.mark.parametrize(
    "code, register", [(0x1000, 0x01), (0x6300, 0x01), (0x8130, 0x11), (0xFF01, 0x81), (0x4200, 0x09)]
)
def test_register_bit_follows_from_the_class_of_the_code(code: int, register: int) -> None:
    assert register_of(code) == register


@given(st.lists(st.tuples(st.booleans(), st.integers(0x8100, 0x8103), st.booleans())))
def test_register_is_0_exactly_when_nothing_is_active_and_the_bus_knows(
    steps: list[tuple[bool, int, bool]],
) -> None:
    errors = Errors()
    active = set()
    for raised, code, allowed in steps:
        errors.allowed = allowed
        if raised:
            errors.service.raise_error(code, 0.0)
            active.add(code)
        else:
            errors.service.clear(code, 0.0)
            active.discard(code)
        assert bool(errors.service.register) == bool(active)
    errors.allowed = True
    errors.service.tick(CAPACITY / RATE)
    frames = errors.wire.take()
    if frames:
        assert bool(frames[-1].data[2]) == bool(active)
