"""Every output of the catalogue has a value that fits its type."""

from __future__ import annotations

import math
import struct

import pytest

from gatewayd.rtde.fields import OUTPUTS
from gatewayd.simulator.arm import ControllerMoment
from gatewayd.simulator.signals import INITIAL, SIGNALS

MOMENTS = [
    ControllerMoment(step, step / 500, step / 700, rate)
    for step in (0, 1, 50_000, 10**9)
    for rate in (0.0, 1.0)
]


@pytest.mark.parametrize("name", sorted(SIGNALS))
def test_a_signal_fits_the_type_of_its_field(name: str) -> None:
    kind = OUTPUTS[name].type
    for moment in MOMENTS:
        values = SIGNALS[name](moment)
        struct.pack(">" + kind.format, *values)
        assert all(math.isfinite(value) for value in values)
        assert values == SIGNALS[name](moment)


def test_initial_values_fit_the_types_of_their_fields() -> None:
    for name, value in INITIAL.items():
        elements = value if isinstance(value, tuple) else (value,)
        struct.pack(">" + OUTPUTS[name].type.format, *elements)
        assert name not in SIGNALS


def test_a_field_without_a_value_of_its_own_is_a_register_or_rests_at_zero() -> None:
    resting = {
        name for name in OUTPUTS if name not in SIGNALS and name not in INITIAL and "_register" not in name
    }
    assert resting == {
        "actual_digital_output_bits",
        "actual_configurable_digital_output_bits",
        "euromap67_output_bits",
        "target_base_acceleration",
        "tool_output_mode",
    }


@pytest.mark.parametrize("name", ["actual_q", "actual_TCP_pose", "actual_TCP_force", "joint_temperatures"])
def test_values_move(name: str) -> None:
    assert SIGNALS[name](ControllerMoment(0, 0.0, 0.0, 1.0)) != SIGNALS[name](
        ControllerMoment(500, 1.0, 1.0, 1.0)
    )


def test_a_standing_arm_has_no_speed() -> None:
    standing = ControllerMoment(500, 1.0, 1.0, 0.0)
    for name in ("actual_qd", "target_qd", "actual_TCP_speed", "elbow_velocity", "actual_TCP_acceleration"):
        assert not any(SIGNALS[name](standing)), name
