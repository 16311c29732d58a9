"""The comparison finds what it is for: each kind of difference, and what is missing."""

from __future__ import annotations

import pytest

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.dictionary import Access, Dictionary, Entry, Pdo, array, variable
from gatewayd.canopen.importer import differences
from gatewayd.links.canopen_node.eds import Sheet, eds_text

NODE = 9
DICTIONARY = Dictionary(
    [
        variable(0x1000, Entry(0, "Device type", CanType.UNSIGNED32, Access.RO, bytes(4))),
        variable(0x1008, Entry(0, "Device name", CanType.VISIBLE_STRING, Access.CONST, b"cell")),
        array(
            0x2010,
            "Numbers",
            [
                Entry(
                    1,
                    "count",
                    CanType.INTEGER32,
                    Access.RWW,
                    (-2).to_bytes(4, "little", signed=True),
                    pdo=Pdo.RECEIVE,
                )
            ],
        ),
    ]
)
TEXT = eds_text(DICTIONARY, Sheet("cell", 1, NODE, 500_000))


def test_our_own_sheet_is_read_as_it_was_meant() -> None:
    assert differences(TEXT, DICTIONARY, NODE) == ()


@pytest.mark.parametrize(
    "meant, spoilt, reported",
    [
        ("ParameterName=count", "ParameterName=amount", "2010h sub 1: name 'count' is read as 'amount'"),
        ("DataType=0x0004", "DataType=0x0007", "2010h sub 1: type 4 is read as 7"),
        ("AccessType=rww", "AccessType=ro", "2010h sub 1: access 'rww' is read as 'ro'"),
        ("PDOMapping=1", "PDOMapping=0", "2010h sub 1: PDO mapping True is read as False"),
        ("[2010sub1]", "[2010sub2]", "2010h sub 1: missing"),
    ],
)
def test_every_difference_is_reported(meant: str, spoilt: str, reported: str) -> None:
    assert TEXT.count(meant) == 1
    assert reported in differences(TEXT.replace(meant, spoilt), DICTIONARY, NODE)
