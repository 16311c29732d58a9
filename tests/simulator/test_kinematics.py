"""Forward kinematics: known poses, and speeds that are derivatives."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.simulator.kinematics import (
    ARMS,
    ELBOW,
    FLANGE,
    MODELS,
    Vector,
    acceleration,
    frames,
    geometry,
    pose,
    rotation_matrix,
    rotation_vector,
    twist,
)

STEP = 1e-6
Q: Vector = (0.4, -1.2, 1.9, -2.0, -1.4, 0.6)
QD: Vector = (0.5, -0.3, 0.8, 0.2, -0.6, 1.1)
QDD: Vector = (-1.0, 0.4, 0.3, -0.7, 0.9, 0.2)
ZERO: Vector = (0.0,) * 6
angles = st.tuples(*[st.floats(-2 * math.pi, 2 * math.pi)] * 6)


def moved(q: Vector, seconds: float) -> Vector:
    return tuple(a + v * seconds for a, v in zip(q, QD, strict=True))


def test_a_stretched_ur5e_reaches_where_its_data_sheet_says() -> None:
    """All joints at 0: the arm lies along -x, the flange points along -y."""
    x, y, z, *rotation = pose(frames(ARMS["ur5e"], ZERO))
    assert (x, y, z) == pytest.approx((-0.8172, -0.2329, 0.0628))
    assert rotation == pytest.approx((math.pi / 2, 0, 0))


def test_an_upright_ur5e_is_as_high_as_its_links() -> None:
    upright = (0.0, -math.pi / 2, 0.0, -math.pi / 2, 0.0, 0.0)
    assert pose(frames(ARMS["ur5e"], upright))[:3] == pytest.approx((0, -0.2329, 0.1625 + 0.8172 + 0.0997))


@pytest.mark.parametrize("model", MODELS)
def test_every_size_keeps_its_lengths(model: str) -> None:
    at = frames(ARMS[model], Q)
    lengths = [math.hypot(a, d) for a, d, *_ in ARMS[model].links]
    assert [math.dist(a, b) for a, b in zip(at.origins, at.origins[1:], strict=False)] == pytest.approx(
        lengths
    )


PUBLISHED = {
    "ur3": (0.1519, -0.24365, -0.21325, 0.11235, 0.08535, 0.0819),
    "ur5": (0.089159, -0.425, -0.39225, 0.10915, 0.09465, 0.0823),
    "ur10": (0.1273, -0.612, -0.5723, 0.163941, 0.1157, 0.0922),
    "ur3e": (0.15185, -0.24355, -0.2132, 0.13105, 0.08535, 0.0921),
    "ur5e": (0.1625, -0.425, -0.3922, 0.1333, 0.0997, 0.0996),
    "ur10e": (0.1807, -0.6127, -0.57155, 0.17415, 0.11985, 0.11655),
    "ur16e": (0.1807, -0.4784, -0.36, 0.17415, 0.11985, 0.11655),
    "ur20": (0.2363, -0.862, -0.7287, 0.201, 0.1593, 0.1543),
    "ur30": (0.2363, -0.637, -0.5037, 0.201, 0.1593, 0.1543),
}
"""z of the shoulder, x of forearm and wrist 1, z of wrist 1, y of wrist 2 and 3: from `default_kinematics.yaml` of the
descriptions for ROS, and from Universal Robots' page of the Denavit-Hartenberg parameters where they have none."""
Array = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


def turned(x: float, y: float, z: float, roll: float, angle: float) -> Array:
    """A fixed offset and a fixed turn about x, and then the joint's about z: how a description for ROS is made up."""
    c, s, cr, sr = math.cos(angle), math.sin(angle), math.cos(roll), math.sin(roll)
    fixed = np.array([[1, 0, 0, x], [0, cr, -sr, y], [0, sr, cr, z], [0, 0, 0, 1]])
    return np.array(fixed @ np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]))


def described(model: str, q: Vector) -> Array:
    """The flange as the description for ROS has it: a second model, of other transformations."""
    shoulder, upper, fore, wrist1, wrist2, wrist3 = PUBLISHED[model]
    quarter = math.pi / 2
    chain = (
        turned(0, 0, shoulder, 0, q[0])
        @ turned(0, 0, 0, quarter, q[1])
        @ turned(upper, 0, 0, 0, q[2])
        @ turned(fore, 0, wrist1, 0, q[3])
        @ turned(0, -wrist2, 0, quarter, q[4])
        @ turned(
            0, wrist3, 0, -quarter, q[5]
        )  # roll 90, pitch and yaw 180 degrees: together a turn by -90 about x
    )
    return np.array(chain)


@pytest.mark.parametrize("model", MODELS)
@given(q=angles)
def test_every_size_is_where_its_description_says(model: str, q: Vector) -> None:
    at, expected = frames(ARMS[model], q), described(model, q)
    assert at.tcp == pytest.approx(expected[:3, 3], abs=1e-9)
    assert [*at.tool] == [pytest.approx(column, abs=1e-9) for column in expected[:3, :3].T]


@pytest.mark.parametrize("model", MODELS)
@given(q=angles)
def test_every_size_moves_as_its_description_does(model: str, q: Vector) -> None:
    """The speed of the tool is the change of the described pose, linear and angular."""
    before, now, after = (described(model, moved(q, seconds)) for seconds in (-STEP, 0.0, STEP))
    change = (after - before) / (2 * STEP)
    spin = change[:3, :3] @ now[:3, :3].T
    speed = twist(frames(ARMS[model], q), QD)
    assert speed[:3] == pytest.approx(change[:3, 3], abs=1e-6)
    assert speed[3:] == pytest.approx([spin[2, 1], spin[0, 2], spin[1, 0]], abs=1e-6)


def test_every_size_was_compared() -> None:
    assert set(PUBLISHED) == set(MODELS)


def test_an_unknown_size_is_a_key_error() -> None:
    with pytest.raises(KeyError):
        geometry("ur99")


@pytest.mark.parametrize("point", [None, ELBOW, FLANGE])
@pytest.mark.parametrize("model", ["ur5e", "ur20"])
def test_linear_speed_is_the_derivative_of_the_position(model: str, point: int | None) -> None:
    arm = geometry(model, (0.05, -0.02, 0.12, 0.3, 0.1, -0.4))

    def position(seconds: float) -> Vector:
        at = frames(arm, moved(Q, seconds))
        return at.tcp if point is None else at.origins[point]

    derived = [(b - a) / (2 * STEP) for a, b in zip(position(-STEP), position(STEP), strict=True)]
    assert twist(frames(arm, Q), QD, point)[:3] == pytest.approx(derived, abs=1e-6)


def test_angular_speed_turns_the_tool() -> None:
    """dR/dt = w x R, column by column."""
    arm = geometry("ur5e", (0.0, 0.0, 0.12, 0.3, 0.1, -0.4))
    wx, wy, wz = twist(frames(arm, Q), QD)[3:]
    before, after = (frames(arm, moved(Q, seconds)).tool for seconds in (-STEP, STEP))
    for (x, y, z), earlier, later in zip(frames(arm, Q).tool, before, after, strict=True):
        derived = [(b - a) / (2 * STEP) for a, b in zip(earlier, later, strict=True)]
        assert (wy * z - wz * y, wz * x - wx * z, wx * y - wy * x) == pytest.approx(derived, abs=1e-6)


def test_acceleration_is_the_derivative_of_the_speed() -> None:
    arm = ARMS["ur5e"]

    def speed(seconds: float) -> Vector:
        q = tuple(a + v * seconds + c * seconds**2 / 2 for a, v, c in zip(Q, QD, QDD, strict=True))
        qd = tuple(v + c * seconds for v, c in zip(QD, QDD, strict=True))
        return twist(frames(arm, q), qd)

    derived = [(b - a) / 2e-4 for a, b in zip(speed(-1e-4), speed(1e-4), strict=True)]
    assert acceleration(arm, Q, QD, QDD) == pytest.approx(derived, abs=1e-4)


@given(angles)
def test_a_rotation_survives_its_vector(q: Vector) -> None:
    rotation = frames(ARMS["ur5e"], q).tool
    back = rotation_matrix(rotation_vector(rotation))
    for column, again in zip(rotation, back, strict=True):
        assert again == pytest.approx(column, abs=1e-5)


@pytest.mark.parametrize(
    "vector",
    [(math.pi, 0, 0), (0, math.pi, 0), (0, 0, -math.pi), (2.2214414690791831, 2.2214414690791831, 0)],
)
def test_half_a_turn_has_an_axis_of_either_sign(vector: tuple[float, float, float]) -> None:
    found = rotation_vector(rotation_matrix(vector))
    assert [abs(part) for part in found] == pytest.approx([abs(part) for part in vector], abs=1e-6)
