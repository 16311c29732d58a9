"""A small recipe with a field of every type, and packages of it."""

from __future__ import annotations

import struct

from hypothesis import strategies as st

from gatewayd.rtde.fields import OUTPUTS
from gatewayd.rtde.recipe import Recipe, Scalar
from gatewayd.rtde.types import DataType

NAMES = (
    "timestamp",
    "actual_q",
    "actual_digital_input_bits",
    "robot_mode",
    "joint_mode",
    "runtime_state",
    "elbow_position",
    "tool_output_mode",
    "output_bit_register_64",
)
RECIPE = Recipe(NAMES, [OUTPUTS[name].type for name in NAMES])

PACKAGES: tuple[tuple[Scalar, ...], ...] = (
    (
        1234.002,
        0.1,
        -0.0,
        1e-05,
        1e16,
        0.1 + 0.2,
        1.0,
        2**64 - 1,
        7,
        *range(-1, 5),
        2,
        0.5,
        1.5,
        2.5,
        255,
        True,
    ),
    (1234.004, 0.2, 0.0, -1e300, 5e-324, 2 / 3, -1.0, 0, -1, *range(6), 1, 0.0, 0.0, 0.0, 0, False),
)

HEADER = (
    "timestamp actual_q_0 actual_q_1 actual_q_2 actual_q_3 actual_q_4 actual_q_5 actual_digital_input_bits robot_mode "
    "joint_mode_0 joint_mode_1 joint_mode_2 joint_mode_3 joint_mode_4 joint_mode_5 runtime_state "
    "elbow_position_0 elbow_position_1 elbow_position_2 tool_output_mode output_bit_register_64"
)
LINES = (
    "1234.002 0.1 -0.0 1e-05 1e+16 0.30000000000000004 1.0 18446744073709551615 7 -1 0 1 2 3 4 2 0.5 1.5 2.5 255 1",
    "1234.004 0.2 0.0 -1e+300 5e-324 0.6666666666666666 -1.0 0 -1 0 1 2 3 4 5 1 0.0 0.0 0.0 0 0",
)
"""The packages as the official client's writer has them, but for booleans, which it writes as True and False."""
TYPES = (
    "DOUBLE DOUBLE DOUBLE DOUBLE DOUBLE DOUBLE DOUBLE UINT64 INT32 INT32 INT32 INT32 INT32 INT32 INT32 UINT32 "
    "DOUBLE DOUBLE DOUBLE UINT8 BOOL"
)

_ELEMENTS: dict[str, st.SearchStrategy[Scalar]] = {
    "?": st.booleans(),
    "d": st.floats(allow_nan=False),
    **{
        code: st.integers(-(2 ** (8 * size - 1)), 2 ** (8 * size - 1) - 1)
        if code.islower()
        else st.integers(0, 2 ** (8 * size) - 1)
        for code, size in ((code, struct.calcsize(">" + code)) for code in "BIQi")
    },
}


def packages_of(recipe: Recipe) -> st.SearchStrategy[tuple[Scalar, ...]]:
    """Any package of a recipe, without NaN, which equals nothing."""
    kinds: list[DataType] = [kind for kind in recipe.types for _ in range(kind.count)]
    return st.tuples(*(_ELEMENTS[kind.code] for kind in kinds))


@st.composite
def recipes(draw: st.DrawFn) -> Recipe:
    """Any output recipe."""
    fields = draw(
        st.lists(
            st.sampled_from(list(OUTPUTS.values())),
            min_size=1,
            max_size=12,
            unique_by=lambda field: field.name,
        )
    )
    return Recipe([field.name for field in fields], [field.type for field in fields])
