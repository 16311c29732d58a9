"""Copying between flat packages and the image: every variable finds its place, everything else is left alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st

from gatewayd.core.definition import Direction, Value, ValueKind, Variable
from gatewayd.links.robot.transfer import InputTransfer, OutputTransfer
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.types import DataType

LAYOUT = Recipe(
    ["timestamp", "word", "pose", "int_0", "int_1", "real", "wide", "flag"],
    [
        DataType.DOUBLE,
        DataType.UINT32,
        DataType.VECTOR6D,
        DataType.INT32,
        DataType.INT32,
        DataType.DOUBLE,
        DataType.UINT64,
        DataType.BOOL,
    ],
)
FLAT: tuple[Value, ...] = (1.5, 0b1010, *(10.0 + n for n in range(6)), 7, 8, 9.5, 1 << 63 | 1, True)


def variable(
    name: str,
    field: str,
    direction: Direction = Direction.OUTPUT,
    bit: int | None = None,
    element: int | None = None,
) -> Variable:
    return Variable(1, name, direction, ValueKind.INT, field, bit=bit, element=element)


def expected(one: Variable, flat: Sequence[Value]) -> Value:
    """The definition, without slices and compilation."""
    value = flat[LAYOUT.slots[one.field].start + (one.element or 0)]
    return value if one.bit is None else bool(int(value) >> one.bit & 1)


POOL = [
    *(variable(f"bit_{bit}", "word", bit=bit) for bit in (0, 1, 2, 3, 31)),
    *(variable(f"wide_{bit}", "wide", bit=bit) for bit in (0, 1, 63)),
    *(variable(f"pose_{n}", "pose", element=n) for n in range(6)),
    *(variable(name, name) for name in ("timestamp", "word", "int_0", "int_1", "real", "flag")),
]


@given(st.lists(st.sampled_from(POOL), max_size=40))
def test_outputs_in_any_order_and_number(chosen: list[Variable]) -> None:
    """Inputs and fields that the recipe lacks, between them, are not touched."""
    variables = [
        one
        for place, drawn in enumerate(chosen)
        for one in (drawn, replace(drawn, direction=Direction.INPUT), variable("absent", "no_such_field"))[
            : place % 4
        ]
    ]
    values: list[Value] = [-1] * len(variables)
    OutputTransfer(variables, LAYOUT.slots).copy(FLAT, values)
    assert values == [
        expected(one, FLAT) if one.direction is Direction.OUTPUT and one.field in LAYOUT.slots else -1
        for one in variables
    ]


def test_neighbours_are_moved_as_one_slice() -> None:
    variables = [variable(f"pose_{n}", "pose", element=n) for n in range(6)]
    transfer = OutputTransfer(
        [*variables, variable("int_0", "int_0"), variable("real", "real")], LAYOUT.slots
    )
    assert transfer._moves == ((slice(0, 7), slice(2, 9)), (slice(7, 8), slice(10, 11)))


def test_bits_are_spread_when_their_word_changes_or_is_forgotten() -> None:
    transfer = OutputTransfer([variable("bit", "word", bit=1)], LAYOUT.slots)
    values: list[Value] = [False]
    transfer.copy(FLAT, values)
    assert values == [True]
    values[0] = False
    transfer.copy(FLAT, values)
    assert values == [False]
    transfer.forget()
    transfer.copy(FLAT, values)
    assert values == [True]


INPUTS = Recipe(["word", "int_0", "pose"], [DataType.UINT32, DataType.INT32, DataType.VECTOR6D])


@given(st.integers(0, 2**32 - 1), st.lists(st.booleans(), min_size=3, max_size=3), st.integers(-5, 5))
def test_what_is_not_mapped_keeps_what_the_controller_holds(word: int, bits: list[bool], number: int) -> None:
    variables = [
        *(variable(f"bit_{bit}", "word", Direction.INPUT, bit=bit) for bit in (0, 7, 31)),
        variable("int_0", "int_0", Direction.INPUT),
        variable("y", "pose", Direction.INPUT, element=1),
        variable("int_0", "int_0"),
    ]
    transfer = InputTransfer(variables, INPUTS.names, INPUTS.slots)
    assert transfer.members == (0, 1, 2, 3, 4)
    transfer.rebase({"word": (word,), "pose": (1.0,) * 6, "elsewhere": (3,)})
    flat = transfer.gather([*bits, number, 0.5, 99])

    mask = 1 | 1 << 7 | 1 << 31
    written = sum(on << bit for on, bit in zip(bits, (0, 7, 31), strict=True))
    assert flat == (word & ~mask | written, number, 1.0, 0.5, 1.0, 1.0, 1.0, 1.0)


def test_adopted_values_are_those_of_the_fields_asked_for() -> None:
    variables = [
        variable("bit", "word", Direction.INPUT, bit=3),
        variable("int_0", "int_0", Direction.INPUT),
        variable("z", "pose", Direction.INPUT, element=2),
    ]
    transfer = InputTransfer(variables, INPUTS.names, INPUTS.slots)
    transfer.rebase({"word": (8,), "int_0": (-4,), "pose": tuple(map(float, range(6)))})
    assert transfer.adopted(["word", "pose"]) == {0: True, 2: 2.0}
    assert transfer.adopted(["int_0"]) == {1: -4}
    assert transfer.adopted([]) == {}


def test_adopted_and_gathered_are_the_same() -> None:
    """What was adopted, sent back, is what the controller holds."""
    variables = [
        *(variable(f"bit_{bit}", "word", Direction.INPUT, bit=bit) for bit in range(0, 32, 2)),
        *(variable(f"pose_{n}", "pose", Direction.INPUT, element=n) for n in (5, 0)),
        variable("int_0", "int_0", Direction.INPUT),
    ]
    transfer = InputTransfer(variables, INPUTS.names, INPUTS.slots)
    held = {"word": (0x12345678,), "int_0": (-(2**31),), "pose": (0.1, -0.0, 1e308, 5e-324, 4.0, 5.0)}
    transfer.rebase(held)
    adopted = transfer.adopted(held)
    assert transfer.gather([adopted[index] for index in range(len(variables))]) == tuple(transfer.base)


def test_parts_are_what_variables_are_in_their_fields_and_the_rest_is_free() -> None:
    bits = tuple(Variable(n + 1, f"bit{n}", Direction.INPUT, ValueKind.BOOL, "word", bit=n) for n in (0, 3))
    element = Variable(3, "y", Direction.INPUT, ValueKind.FLOAT, "pose", element=1)
    transfer = InputTransfer((*bits, element), LAYOUT.names, LAYOUT.slots)
    assert [part.of([0b1000]) for part in transfer.parts["word"]] == [False, True]
    assert transfer.free("word", [0b11001]) == [0b10000]
    pose = [10.0, 11.0, 12.0, 13.0, 14.0, 15.0]
    assert [part.of(pose) for part in transfer.parts["pose"]] == [11.0]
    assert transfer.free("pose", pose) == [10.0, 0, 12.0, 13.0, 14.0, 15.0]
