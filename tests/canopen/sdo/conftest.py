"""A dictionary with an object of every kind, and a server for it."""

from __future__ import annotations

import pytest

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.dictionary import Access, Dictionary, Entry, array, record, variable
from gatewayd.canopen.sdo.server import SdoServer


def _names() -> list[Entry]:
    return [
        Entry(1, "level", CanType.UNSIGNED16, Access.RW, bytes(2), low=10, high=1000),
        Entry(2, "secret", CanType.UNSIGNED32, Access.WO, bytes(4)),
        Entry(3, "offset", CanType.INTEGER16, Access.RW, bytes(2), low=-5),
    ]


@pytest.fixture
def dictionary() -> Dictionary:
    return Dictionary(
        [
            variable(0x1000, Entry(0, "Device type", CanType.UNSIGNED32, Access.CONST, bytes(4))),
            variable(0x1008, Entry(0, "Device name", CanType.VISIBLE_STRING, Access.CONST, b"gatewayd")),
            record(0x2000, "Settings", _names()),
            array(
                0x2001,
                "Numbers",
                [Entry(n, f"n{n}", CanType.UNSIGNED8, Access.RW, bytes([n])) for n in range(1, 4)],
            ),
            variable(0x2002, Entry(0, "Real", CanType.REAL64, Access.RW, bytes(8))),
            variable(0x2003, Entry(0, "Flag", CanType.BOOLEAN, Access.RW, bytes(1))),
            variable(0x2004, Entry(0, "Text", CanType.VISIBLE_STRING, Access.RW, b"")),
            variable(0x2005, Entry(0, "Data", CanType.DOMAIN, Access.RW, b"")),
            variable(0x2006, Entry(0, "Word", CanType.UNSIGNED32, Access.RW, b"\1\2\3\4")),
        ]
    )


@pytest.fixture
def server(dictionary: Dictionary) -> SdoServer:
    return SdoServer(dictionary)
