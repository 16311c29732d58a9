"""What a device gets of the robot's outputs."""

from __future__ import annotations

import pytest

from gatewayd.core.definition import Value
from gatewayd.links.devices.outflow import RETRY_AFTER, Outflow
from gatewayd.links.devices.plan import Sending
from tests.links.devices.cells import NOW, FakeRobot, planned

LINES = """\
  clamp: {{robot: output_int_register_4, device: {{at: island, holding: 0}}, on_stale: {on_stale}}}
  force: {{robot: output_int_register_7, device: {{at: gripper, holding: 1}}}}
  present: {{robot: input_bit_register_0, device: {{at: island, discrete: 3}}, owner: island}}
"""


class Output:
    """One output of a cell on its way to a device."""

    def __init__(self, on_stale: str = "clear", *, write: bool = False, every: float | None = None) -> None:
        self.robot = FakeRobot(planned(LINES.format(on_stale=on_stale)))
        self.sent: list[Value] = []
        self.outflow = Outflow(self.robot.cell, [Sending(0, write, every)], self._take)
        self.robot.cell.listeners.append(lambda _direction: self.outflow.update(NOW))

    def _take(self, variable: int, value: Value) -> None:
        assert variable == 0
        self.sent.append(value)


def test_nothing_is_written_before_the_robot_is_fresh() -> None:
    output = Output(write=True)
    output.outflow.connect(NOW)
    assert output.sent == []
    output.robot.fresh(clamp=7)
    assert output.sent == [7]


def test_it_waits_for_a_change_unless_it_is_to_bring_the_device_up_to_date() -> None:
    output = Output()
    output.robot.fresh(clamp=7)
    output.outflow.connect(NOW)
    output.robot.fresh(NOW + 0.01, clamp=7)
    assert output.sent == []
    output.robot.fresh(NOW + 0.02, clamp=8)
    assert output.sent == [8]


@pytest.mark.parametrize("write, sent", [(False, [8]), (True, [7, 8, 8])])
def test_a_device_that_comes_back_is_treated_like_a_new_one(write: bool, sent: list[Value]) -> None:
    output = Output(write=write)
    output.robot.fresh(clamp=7)
    output.outflow.connect(NOW)
    output.robot.fresh(NOW + 0.01, clamp=8)
    output.outflow.lose()
    output.outflow.connect(NOW + 0.02)
    assert output.sent == sent


@pytest.mark.parametrize(
    "on_stale, sent", [("clear", [8, 0, 8]), ("5", [8, 5, 8]), ("hold", [8]), ("exception", [8])]
)
def test_the_device_gets_what_is_declared_when_the_robot_is_stale(on_stale: str, sent: list[Value]) -> None:
    output = Output(on_stale)
    output.robot.fresh(clamp=7)
    output.outflow.connect(NOW)
    output.robot.fresh(NOW + 0.01, clamp=8)
    output.robot.cell.robot_lost("gone", NOW + 0.02)
    output.robot.fresh(NOW + 0.03, clamp=8)
    assert output.sent == sent


def test_a_device_that_comes_while_the_robot_is_stale_gets_nothing() -> None:
    output = Output(write=True)
    output.robot.fresh(clamp=7)
    output.robot.cell.robot_lost("gone", NOW)
    output.outflow.connect(NOW)
    assert output.sent == []


def test_it_is_repeated_once_it_was_written() -> None:
    output = Output(every=1.0)
    output.robot.fresh(clamp=7)
    output.outflow.connect(NOW)
    output.outflow.tick(NOW + 5)
    assert output.sent == []
    output.robot.fresh(NOW, clamp=8)
    output.outflow.tick(NOW + 0.9)
    output.outflow.tick(NOW + 1.0)
    output.outflow.tick(NOW + 1.1)
    assert output.sent == [8, 8]


@pytest.mark.parametrize("on_stale, repeats", [("exception", 0), ("hold", 1)])
def test_repeats_end_where_writing_does(on_stale: str, repeats: int) -> None:
    output = Output(on_stale, write=True, every=1.0)
    output.robot.fresh(clamp=7)
    output.outflow.connect(NOW)
    output.robot.cell.robot_lost("gone", NOW)
    output.outflow.tick(NOW + 1.5)
    assert output.sent == [7] * (1 + repeats)


def test_nan_is_no_news() -> None:
    output = Output()
    nan = float("nan")
    output.robot.fresh(clamp=7)
    output.outflow.connect(NOW)
    output.robot.fresh(NOW, clamp=nan)
    output.robot.fresh(NOW, clamp=float("nan"))
    assert len(output.sent) == 1


def test_what_was_written_is_known_in_the_successor() -> None:
    output = Output(write=True)
    output.robot.fresh(clamp=7, force=7)
    output.outflow.connect(NOW)
    output.outflow.rebind(output.robot.cell, [Sending(1)], {0: 1})
    output.outflow.update(NOW)
    assert output.sent == [7]


@pytest.mark.parametrize("write, sent", [(False, []), (True, [7, 7])])
def test_a_device_on_a_new_connection_may_have_begun_anew(write: bool, sent: list[Value]) -> None:
    output = Output(write=write)
    output.robot.fresh(clamp=7)
    output.outflow.connect(NOW)
    output.outflow.renew(NOW + 1)
    output.outflow.renew(NOW + 1.1)  # one that closes each connection is not written with each of them
    assert output.sent == sent


def test_a_device_on_a_new_connection_gets_nothing_before_the_robot_is_fresh_again() -> None:
    output = Output("hold", write=True, every=1.0)
    output.robot.fresh(clamp=7)
    output.outflow.connect(NOW)
    output.robot.cell.robot_lost("gone", NOW)
    output.outflow.renew(NOW + 0.5)
    output.outflow.tick(NOW + 2)
    assert output.sent == [7]
    output.robot.fresh(NOW + 3, clamp=8)
    assert output.sent == [7, 8]


def test_a_value_that_is_not_answered_is_given_again_until_it_is() -> None:
    output = Output()
    output.robot.fresh(clamp=7)
    output.outflow.connect(NOW)
    output.robot.fresh(NOW, clamp=8)
    output.outflow.unanswered(0, NOW)
    output.outflow.tick(NOW + 0.9 * RETRY_AFTER)
    assert output.sent == [8]
    output.outflow.tick(NOW + RETRY_AFTER)
    output.outflow.tick(NOW + 2 * RETRY_AFTER)
    assert output.sent == [8, 8]
    output.outflow.lose()
    output.outflow.unanswered(0, NOW)
    output.outflow.tick(NOW + 5 * RETRY_AFTER)
    assert output.sent == [8, 8]
