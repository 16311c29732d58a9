"""What is written into a device: concise DCF, the order of PDO parameters, what is expected of a PDO."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.canopen.manager.configuration import (
    ConfigurationError,
    concise_dcf,
    pdo_expectations,
    pdo_settings,
    read_concise_dcf,
)
from gatewayd.canopen.manager.plan import ManagedPdo, PdoObject, Setting

OBJECTS = (PdoObject(0x6000, 1, 8), PdoObject(0x6000, 2, 8))


def test_pdo_is_switched_off_emptied_filled_counted_and_switched_on() -> None:
    pdo = ManagedPdo(3, False, 0x405, OBJECTS, written=True, transmission=254)
    assert [(item.index, item.subindex, item.data.hex()) for item in pdo_settings(pdo)] == [
        (0x1402, 1, "05040080"),
        (0x1402, 2, "fe"),
        (0x1602, 0, "00"),
        (0x1602, 1, "08010060"),
        (0x1602, 2, "08020060"),
        (0x1602, 0, "02"),
        (0x1402, 1, "05040000"),
    ]


def test_tpdo_that_cannot_be_asked_for_keeps_the_bit_that_says_so() -> None:
    pdo = ManagedPdo(1, True, 0x185, OBJECTS, written=True, no_remote=True)
    written = list(pdo_settings(pdo))
    assert written[0].data.hex() == "850100c0"
    assert written[-1].data.hex() == "85010040"


def test_expected_layout_leaves_open_whether_it_can_be_asked_for() -> None:
    cob_id, count, *objects = pdo_expectations(ManagedPdo(1, True, 0x185, OBJECTS))
    assert 0x4000_0185 & cob_id.mask == cob_id.number
    assert 0x8000_0185 & cob_id.mask != cob_id.number
    assert (count.index, count.number) == (0x1A00, 2)
    assert [item.number for item in objects] == [0x60000108, 0x60000208]


settings_ = st.builds(Setting, st.integers(0, 0xFFFF), st.integers(0, 0xFF), st.binary(max_size=20))


@given(st.lists(settings_, max_size=20))
def test_concise_dcf_there_and_back(items: list[Setting]) -> None:
    assert read_concise_dcf(concise_dcf(items)) == tuple(items)


@pytest.mark.parametrize(
    "data, text",
    [
        (b"\1\0\0", "begins with four bytes"),
        (b"\xff\xff\xff\xff", "more than the 4096"),
        (b"\1\0\0\0\0\x20", "ends before object 1 of 1"),
        (b"\1\0\0\0\0\x20\1\4\0\0\0\1", "ends within 2000h:01"),
        (b"\1\0\0\0\0\x20\1\1\0\0\0\1\0", "more after the last object"),
    ],
)
def test_what_is_no_concise_dcf(data: bytes, text: str) -> None:
    with pytest.raises(ConfigurationError, match=text):
        read_concise_dcf(data)


@given(st.binary(max_size=60))
def test_hostile_concise_dcf(data: bytes) -> None:
    try:
        items = read_concise_dcf(data)
    except ConfigurationError:
        return
    assert concise_dcf(items) == data
