"""A prepared write does what `Cell.write` does with the same changes, or nothing.

`test_cell_properties` holds it to the naive account of the rules, in any order of acts; here each cause stands alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from copy import deepcopy

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell, Written
from gatewayd.core.definition import Value
from gatewayd.core.prepared import PreparedWrite
from gatewayd.core.requester import Requester
from tests.core.conftest import HMI, PLC

START, LAMP, PART, FORCE, SPEED, PATH, CYCLES = range(7)
ALL = (START, LAMP, PART, FORCE, SPEED, PATH)
VALUES: list[Value] = [True, False, 7, 20.0, 0.5, 3]
OWNER = Requester(PLC, "192.0.2.1:5000", 11)


def state(cell: Cell) -> object:
    image, locks, delivery = cell.image, cell.ownership, cell.delivery
    return deepcopy(
        (
            (image.values, image.times, image.quality, image.available),
            (locks.owners, locks.connections, locks.expires, locks.orphans, locks._next_expiry),
            (delivery.given_at, delivery.owed, delivery.under_way, delivery.unread, delivery.differing),
            (cell.writers.alive, cell.writers.last_seen, cell.health, list(cell.events)),
        )
    )


@pytest.fixture
def owned(cell: Cell) -> Cell:
    """The press, all of whose inputs the PLC owns since 1.0."""
    changes = [Change(index, value) for index, value in zip(ALL, VALUES, strict=True)]
    assert cell.write(OWNER, changes, 1.0) is None
    return cell


@given(
    chosen=st.permutations(ALL).flatmap(lambda order: st.integers(1, 6).map(lambda count: order[:count])),
    given_values=st.tuples(
        st.booleans(),
        st.one_of(st.integers(-(2**31), 2**31 - 1), st.sampled_from([2**31, -(2**31) - 1])),
        st.one_of(st.floats(-2, 160), st.sampled_from([0.0, 1.0, 150.0, math.nan, math.inf])),
    ),
    connection=st.integers(0, 3),
    listened=st.booleans(),
)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_it_does_what_the_thorough_way_does(
    owned: Cell, chosen: list[int], given_values: tuple[Value, ...], connection: int, listened: bool
) -> None:
    prepared_cell, thorough_cell = deepcopy(owned), deepcopy(owned)
    heard: list[list[object]] = [[], []]
    if listened:
        for cell, record in zip((prepared_cell, thorough_cell), heard, strict=True):
            cell.write_listeners.append(lambda *written, record=record: record.append(written))
    values = [given_values[(bool, int, float).index(type(VALUES[index]))] for index in chosen]
    asking = Requester(PLC, "192.0.2.1:5001", connection)
    before = state(prepared_cell)
    done = PreparedWrite(prepared_cell, chosen).write(asking, values, 2.0)
    if not done:
        assert state(prepared_cell) == before
        return
    changes = [Change(index, value) for index, value in zip(chosen, values, strict=True)]
    assert thorough_cell.write(asking, changes, 2.0) is None
    assert state(prepared_cell) == state(thorough_cell)
    assert heard[0] == heard[1]


def test_what_the_owner_may_write_is_written(owned: Cell) -> None:
    prepared = PreparedWrite(owned, ALL)
    listened: list[Written] = []
    owned.write_listeners.append(lambda _writer, changed, _now: listened.append(list(changed)))
    assert prepared.write(OWNER, [True, False, 8, 20.0, 0.25, 3], 2.0)
    assert owned.image.values[:6] == [True, False, 8, 20.0, 0.25, 3]
    assert listened == [[(PART, 7, 8), (SPEED, 0.5, 0.25)]]
    assert owned.ownership.expires[1] == 7.0


def lost(cell: Cell) -> None:
    cell.robot_lost("gone", 2.0)


def unavailable(cell: Cell) -> None:
    cell.set_availability([PART], False, "held", 2.0)


def released(cell: Cell) -> None:
    assert cell.release(OWNER, PART, 2.0) is None


def taken(cell: Cell) -> None:
    cell.operator.take_lock(2, 2.0)


def closed(cell: Cell) -> None:
    cell.ownership.orphans[2] = 9.0


@pytest.mark.parametrize(
    "cause", [lost, unavailable, released, taken, closed], ids=lambda cause: cause.__name__
)
def test_what_has_happened_since_is_noticed(owned: Cell, cause: Callable[[Cell], None]) -> None:
    prepared = PreparedWrite(owned, ALL)
    assert prepared.write(OWNER, VALUES, 1.5)
    cause(owned)
    before = state(owned)
    assert not prepared.write(OWNER, VALUES, 2.0)
    assert state(owned) == before


def test_an_ended_lease_is_noticed(owned: Cell) -> None:
    prepared = PreparedWrite(owned, ALL)
    assert prepared.write(OWNER, VALUES, 1.5)
    assert not prepared.write(OWNER, VALUES, 3.6)
    assert owned.ownership.owners[2] is None


@pytest.mark.parametrize(
    "asking",
    [
        Requester(None),
        Requester(HMI, "", 5),
        Requester(PLC, "", 11, trusted=False),
        Requester(PLC, "", 11, waited=0.1),
    ],
    ids=["undeclared", "another", "untrusted", "late"],
)
def test_only_its_owner_writes_so(owned: Cell, asking: Requester) -> None:
    before = state(owned)
    assert not PreparedWrite(owned, ALL).write(asking, VALUES, 1.5)
    assert state(owned) == before


@pytest.mark.parametrize(
    "index, value",
    [(PART, 2**31), (FORCE, 151.0), (FORCE, math.nan), (SPEED, -0.1), (SPEED, math.inf)],
)
def test_what_has_to_be_clamped_or_refused_is_left_to_be_judged(
    owned: Cell, index: int, value: Value
) -> None:
    before = state(owned)
    assert not PreparedWrite(owned, [index]).write(OWNER, [value], 1.5)
    assert state(owned) == before


@pytest.mark.parametrize("variables", [(CYCLES,), (PART, PART), (PART, CYCLES)])
def test_what_is_always_refused_cannot_be_prepared(cell: Cell, variables: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="refused"):
        PreparedWrite(cell, variables)


@pytest.mark.parametrize("values", [VALUES[:-1], [*VALUES, 1], []], ids=len)
def test_another_number_of_values_is_a_defect_that_changes_nothing(owned: Cell, values: list[Value]) -> None:
    before = state(owned)
    with pytest.raises(ValueError, match="one value for each"):
        PreparedWrite(owned, ALL).write(OWNER, values, 1.5)
    assert state(owned) == before
