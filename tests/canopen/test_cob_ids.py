"""The predefined connection set, and the identifiers that nobody may use."""

from __future__ import annotations

import pytest

from gatewayd.canopen.cob_ids import is_restricted, node_of, predefined_pdo


def test_predefined_pdos_are_those_of_the_standard() -> None:
    """CiA 301, table 40, for node 5."""
    assert [predefined_pdo(number, 5, transmit=True) for number in range(1, 5)] == [
        0x185,
        0x285,
        0x385,
        0x485,
    ]
    assert [predefined_pdo(number, 5, transmit=False) for number in range(1, 5)] == [
        0x205,
        0x305,
        0x405,
        0x505,
    ]


@pytest.mark.parametrize("number", [0, 5, 512])
def test_only_four_pdos_are_predefined(number: int) -> None:
    assert predefined_pdo(number, 5, transmit=True) is None


@pytest.mark.parametrize(
    "first,last",
    [(0, 0x7F), (0x101, 0x180), (0x581, 0x5FF), (0x601, 0x67F), (0x6E0, 0x6FF), (0x701, 0x7FF)],
)
def test_restricted_identifiers_end_where_the_standard_says(first: int, last: int) -> None:
    """CiA 301, table 41."""
    assert all(map(is_restricted, range(first, last + 1)))
    assert first == 0 or not is_restricted(first - 1)
    assert last == 0x7FF or not is_restricted(last + 1)


def test_every_predefined_pdo_may_be_used() -> None:
    for node in range(1, 128):
        for number in range(1, 5):
            for transmit in (True, False):
                can_id = predefined_pdo(number, node, transmit=transmit)
                assert can_id is not None
                assert not is_restricted(can_id)


@pytest.mark.parametrize(
    "can_id, node",
    [(0x085, 5), (0x185, 5), (0x57F, 127), (0x585, 5), (0x605, 5), (0x705, 5)]
    + [(can_id, None) for can_id in (0x000, 0x005, 0x080, 0x105, 0x180, 0x685, 0x7E4, 0x7E5, 0x80000000)],
)
def test_whose_identifier_it_is(can_id: int, node: int | None) -> None:
    assert node_of(can_id) == node
