"""The images that are measured are valid mappings, and the contents of writes change from one to the next."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from gatewayd.links.modbus_server.plan import ModbusPlan
from gatewayd.mapping.loader import load
from tests.benchmarks.image import INTEGERS_IN, WRITABLE, everything_on, full_image, numbers
from tests.benchmarks.throughput import ROWS


@pytest.mark.parametrize("image", [full_image, everything_on])
def test_an_image_can_be_served(image: Callable[[int, int], str]) -> None:
    loaded = load(image(30004, 1502).encode(), "image.yaml")
    assert loaded.plan is not None, loaded.diagnostics
    assert isinstance(loaded.plan.the(ModbusPlan), ModbusPlan)


def test_all_on_has_a_group_that_two_may_own_limits_and_leases() -> None:
    plan = load(everything_on(30004, 1502).encode(), "image.yaml").plan
    assert plan is not None
    motion = next(lock for lock in plan.cell.locks if lock.name == "motion")
    assert len(motion.owners) == 2
    assert motion.lease == 5.0
    members = [
        one for one in plan.cell.variables if one.lock is not None and plan.cell.locks[one.lock] is motion
    ]
    assert len(members) == 48
    assert all(one.limits is not None for one in members)


def test_every_value_of_a_write_differs_from_the_one_before() -> None:
    for registers in (10, WRITABLE):
        first, second = numbers(registers, 0), numbers(registers, 1)
        assert len(first) == 2 * registers
        integers = [first[at : at + 4] != second[at : at + 4] for at in range(0, min(96, 2 * registers), 4)]
        doubles = [first[at : at + 8] != second[at : at + 8] for at in range(96, 2 * registers, 8)]
        assert all(integers + doubles)


def test_rows_with_changing_values_have_them_and_the_others_not() -> None:
    assert INTEGERS_IN == 10
    for name, row in ROWS.items():
        changes = "same" not in name and not name.startswith("FC3")
        assert (len(set(row.request.frames)) > 1) is changes
