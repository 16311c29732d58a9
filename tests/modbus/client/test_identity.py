from __future__ import annotations

from gatewayd.modbus.areas import Area
from gatewayd.modbus.client.grouping import WantedItem
from gatewayd.modbus.client.identity import IdentityReader, UnitIdentity
from gatewayd.modbus.client.requests import read, read_identification

SERIAL = WantedItem(Area.INPUT, 100, 2)


def objects(*, more: int | None = None, **texts: str) -> bytes:
    head = bytes((1, 1, 0 if more is None else 0xFF, more or 0, len(texts)))
    return head + b"".join(
        bytes((int(key[1:]), len(text))) + text.encode("latin-1") for key, text in texts.items()
    )


def test_identification_in_pieces_then_the_serial_number() -> None:
    reader = IdentityReader(is_identified=True, serial=SERIAL)
    reader.begin()
    assert reader.request == read_identification()
    assert reader.answered(objects(_0="vendor", more=1)) is None
    assert reader.request == read_identification(1)
    assert reader.answered(objects(_1="code \xe9")) is None
    assert reader.request == read(*SERIAL)
    identity = reader.answered(b"\x00\x01\x02\x03")
    assert identity == UnitIdentity(((0, "vendor"), (1, "code \ufffd")), b"\x00\x01\x02\x03")
    assert reader.request is None


def test_unit_that_refuses_has_no_such_data() -> None:
    reader = IdentityReader(is_identified=True, serial=SERIAL)
    reader.begin()
    reader.answered(None)
    assert reader.answered(None) == UnitIdentity()


def test_nobody_asks_where_nothing_was_declared() -> None:
    reader = IdentityReader(is_identified=False, serial=None)
    reader.begin()
    assert reader.request is None


def test_identification_that_never_ends_is_bounded() -> None:
    reader = IdentityReader(is_identified=True, serial=None)
    reader.begin()
    for number in range(100):
        if reader.answered(objects(**{f"_{number}": "x"}, more=number + 1)) is not None:
            break
    assert number < 20


def test_identification_that_goes_round_ends() -> None:
    reader = IdentityReader(is_identified=True, serial=None)
    reader.begin()
    assert reader.answered(objects(_0="x", more=0)) == UnitIdentity(((0, "x"),))


def test_garbage_is_no_identification() -> None:
    reader = IdentityReader(is_identified=True, serial=None)
    reader.begin()
    assert reader.answered(b"\x01") == UnitIdentity()


def test_what_has_changed_is_said() -> None:
    former = UnitIdentity(((0, "A"), (2, "1.0"), (128, "x")), b"\x01")
    assert UnitIdentity(((0, "A"), (2, "1.1"), (128, "y")), b"\x02").changes(former) == [
        "revision 1.1 instead of 1.0",
        "object 128 y instead of x",
        "serial number 02 instead of 01",
    ]
    assert UnitIdentity().changes(former) == [], "it did not say"
