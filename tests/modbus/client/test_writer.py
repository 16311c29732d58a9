from __future__ import annotations

from gatewayd.modbus.areas import Area
from gatewayd.modbus.client.polling import AT_ONCE, NEVER
from gatewayd.modbus.client.requests import ExceptionAnswer, TimedOut, mask_register, read, write_register
from gatewayd.modbus.client.writer import UnitWriter, WriteResult
from gatewayd.modbus.client.writes import PartWrite

PART = PartWrite(7, 0x00FF, 0x0042)
OTHER = write_register(8, b"\0\1")
ILLEGAL_FUNCTION = ExceptionAnswer(1)


def writer(*, has_mask_write: bool) -> UnitWriter:
    made = UnitWriter(has_mask_write=has_mask_write)
    made.put("part", PART, None, 0)
    made.put("other", OTHER, None, 0)
    return made


def test_part_of_a_register_by_fc_22() -> None:
    own = writer(has_mask_write=True)
    assert own.take(0) == mask_register(7, 0xFF00, 0x0042)
    assert own.done(b"", 0) == WriteResult("part", None)
    assert own.take(0) == OTHER


def test_part_of_a_register_by_reading_and_writing_with_nothing_between() -> None:
    own = writer(has_mask_write=False)
    assert own.take(0) == read(Area.HOLDING, 7, 1)
    assert own.due == NEVER
    assert own.done(b"\x12\x34", 0) is None
    assert own.due == AT_ONCE
    assert own.take(0) == write_register(7, b"\x12\x42")
    assert own.done(b"", 0) == WriteResult("part", None)
    assert own.take(0) == OTHER


def test_unit_without_fc_22_is_asked_for_it_once() -> None:
    own = writer(has_mask_write=True)
    own.take(0)
    assert own.done(ILLEGAL_FUNCTION, 0) is None
    assert own.take(0) == read(Area.HOLDING, 7, 1)
    own.done(b"\0\0", 0)
    own.take(0)
    own.done(b"", 0)
    own.put("part", PART, None, 0)
    own.take(0)
    own.done(b"", 0)
    assert own.take(0) == read(Area.HOLDING, 7, 1)


def test_newer_part_counts_after_reading_failed() -> None:
    own = writer(has_mask_write=False)
    own.take(0)
    own.put("part", PartWrite(7, 0xFF, 0x43), None, 0)
    assert own.done(TimedOut(0.3), 0) is None
    assert own.take(1) == OTHER


def test_refusal_to_write_back_is_the_end_of_the_write() -> None:
    own = writer(has_mask_write=False)
    own.take(0)
    own.done(b"\0\0", 0)
    own.take(0)
    assert own.done(ExceptionAnswer(2), 0) == WriteResult("part", ExceptionAnswer(2))


def test_loss_between_reading_and_writing_back_forgets_both() -> None:
    own = writer(has_mask_write=False)
    own.take(0)
    own.done(b"\0\0", 0)
    own.clear()
    assert own.due == NEVER


def test_lost_connection_begins_the_write_again() -> None:
    own = writer(has_mask_write=False)
    own.take(0)
    own.done(b"\0\0", 0)
    own.take(0)
    own.put_back()
    assert own.take(0) == read(Area.HOLDING, 7, 1)
