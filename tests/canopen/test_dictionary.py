"""What the dictionary checks for all services: existence, access, length, range."""

from __future__ import annotations

import pytest

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.dictionary import (
    Abort,
    AbortCode,
    Access,
    Dictionary,
    Entry,
    array,
    record,
    variable,
)


def dictionary(*entries: Entry) -> Dictionary:
    return Dictionary([record(0x2000, "settings", entries), variable(0x1000, _type())])


def _type() -> Entry:
    return Entry(0, "Device type", CanType.UNSIGNED32, Access.CONST, bytes(4))


def _step() -> Entry:
    return Entry(1, "step", CanType.UNSIGNED8, Access.RW, b"\x02", low=1, high=10)


def _code(call: object, *arguments: object) -> AbortCode:
    assert callable(call)
    with pytest.raises(Abort) as caught:
        call(*arguments)
    return caught.value.code


def test_what_is_not_there() -> None:
    objects = dictionary(_step())
    assert _code(objects.read, 0x2001, 0) is AbortCode.NO_OBJECT
    assert _code(objects.read, 0x2000, 2) is AbortCode.NO_SUBINDEX
    assert _code(objects.write, 0x1000, 1, b"\0") is AbortCode.NO_SUBINDEX


def test_access() -> None:
    objects = dictionary(_step(), Entry(2, "secret", CanType.UNSIGNED8, Access.WO, b"\0"))
    assert _code(objects.write, 0x1000, 0, bytes(4)) is AbortCode.READ_ONLY
    assert _code(objects.read, 0x2000, 2) is AbortCode.WRITE_ONLY
    objects.write(0x2000, 2, b"\x05")


@pytest.mark.parametrize(
    "data,code",
    [
        (b"", AbortCode.TOO_SHORT),
        (b"\x01\x00", AbortCode.TOO_LONG),
        (b"\x00", AbortCode.VALUE_TOO_LOW),
        (b"\x0b", AbortCode.VALUE_TOO_HIGH),
    ],
)
def test_length_and_range(data: bytes, code: AbortCode) -> None:
    objects = dictionary(_step())
    assert _code(objects.write, 0x2000, 1, data) is code
    assert objects.read(0x2000, 1) == b"\x02"


def test_a_boolean_is_0_or_1() -> None:
    objects = dictionary(Entry(1, "on", CanType.BOOLEAN, Access.RW, b"\0"))
    assert _code(objects.write, 0x2000, 1, b"\x55") is AbortCode.VALUE_TOO_HIGH


def test_highest_subindex_is_made_where_it_is_missing() -> None:
    objects = Dictionary([array(0x2000, "steps", [_step()]), array(0x2001, "none", [])])
    assert objects.read(0x2000, 0) == b"\x01"
    assert objects.read(0x2001, 0) == b"\x00"


def test_check_refuses_before_the_value_changes_and_changed_is_called_after() -> None:
    stored: list[bytes] = []

    def check(data: bytes) -> None:
        if data == b"\x03":
            raise Abort(AbortCode.DEVICE_STATE)

    entry = Entry(1, "step", CanType.UNSIGNED8, Access.RW, b"\x02", check=check)
    entry.changed = lambda: stored.append(entry.value)
    assert _code(entry.write, b"\x03") is AbortCode.DEVICE_STATE
    entry.write(b"\x04")
    assert stored == [b"\x04"]


def test_source_and_sink_stand_in_for_the_value() -> None:
    taken: list[bytes] = []
    entry = Entry(1, "live", CanType.UNSIGNED8, Access.RW, b"\0", source=lambda: b"\x07", sink=taken.append)
    entry.write(b"\x01")
    assert (taken, entry.value, entry.read()) == ([b"\x01"], b"\0", b"\x07")


def test_objects_come_in_the_order_of_their_index() -> None:
    assert [item.index for item in dictionary(_step())] == [0x1000, 0x2000]


def _mapping(first: int, second: int) -> Dictionary:
    slots = [Entry(number, f"slot {number}", CanType.UNSIGNED8, Access.RW, bytes((value,)))
             for number, value in ((1, first), (2, second))]  # fmt: skip
    return dictionary(*slots)


@pytest.mark.parametrize(
    "written, defaults, found",
    [
        ((), (1, 2), (1, 2)),
        (((1, 9),), (1, 2), (9, 2)),
        ((), (1, 3), (1, 3)),
        (((1, 9),), (1, 3), (9, 2)),
    ],
)
def test_what_a_client_wrote_goes_on_whole_and_what_it_left_follows_new_defaults(
    written: tuple[tuple[int, int], ...], defaults: tuple[int, int], found: tuple[int, int]
) -> None:
    """Half of an object as it was written and half as it is by default now would be neither."""
    former, successor = _mapping(1, 2), _mapping(*defaults)
    for subindex, value in written:
        former.write(0x2000, subindex, bytes((value,)))
    successor.resume(former)
    assert tuple(successor.read(0x2000, subindex)[0] for subindex in (1, 2)) == found


def test_a_successor_need_not_have_all_of_it() -> None:
    former, successor = (
        dictionary(_step(), Entry(2, "more", CanType.UNSIGNED8, Access.RW, b"\0")),
        dictionary(_step()),
    )
    former.write(0x2000, 1, b"\5")
    successor.resume(former)
    assert successor.read(0x2000, 1) == b"\5"
