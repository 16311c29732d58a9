"""The controller: cycles, rates, versions, claims."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest

from gatewayd.rtde.fields import Field, Series, SoftwareVersion
from gatewayd.rtde.types import DataType
from gatewayd.simulator.controller import INTERNAL, Controller
from gatewayd.simulator.faults import ADAPTER_FIELDS, Faults
from gatewayd.simulator.program import parse


@pytest.mark.parametrize("series,step", [(Series.CB3, 0.008), (Series.E, 0.002), (Series.X, 0.002)])
def test_the_timestamp_steps_by_exactly_one_period(series: Series, step: float) -> None:
    controller = Controller(series)
    stamps = []
    for _ in range(2000):
        controller.advance()
        stamps.append(controller.get("timestamp")[0])
    assert stamps[0] == pytest.approx(100 + step)
    assert max(abs(b - a - step) for a, b in pairwise(stamps)) < 1e-9


@pytest.mark.parametrize(
    "series,frequency,period",
    [
        (Series.E, 500, 1),
        (Series.E, 200, 2),
        (Series.E, 125, 4),
        (Series.E, 251, 1),
        (Series.E, 0, 1),
        (Series.E, 1000, 1),
        (Series.E, -3, 1),
        (Series.E, math.nan, 1),
        (Series.E, math.inf, 1),
        (Series.E, 0.1, 500),
        (Series.E, None, 4),
        (Series.CB3, None, 1),
        (Series.CB3, 125, 1),
        (Series.CB3, 50, 2),
    ],
)
def test_a_frequency_is_divided_as_the_controller_does(
    series: Series, frequency: float | None, period: int
) -> None:
    assert Controller(series).period(frequency) == period


def test_fields_come_with_their_version() -> None:
    old, new = (Controller(Series.E, SoftwareVersion(5, minor)) for minor in (2, 26))
    assert (old.input_type("input_int_register_24"), old.output_type("actual_TCP_acceleration")) == (
        None,
        None,
    )
    assert new.input_type("input_int_register_24")
    assert new.output_type("actual_TCP_acceleration")
    assert old.input_type("input_int_register_23")
    assert new.input_type("output_int_register_0") is None
    assert new.output_type("nothing") is None


def test_creep_moves_the_timestamp_by_nothing_to_speak_of() -> None:
    controller = Controller(program=parse("output_int_register_0 = count every 10ms"))
    controller.faults.creep = True
    stamps = []
    for _ in range(50):
        controller.advance()
        stamps.append(float(controller.get("timestamp")[0]))
    assert all(0 < after - before < 2e-9 for before, after in pairwise(stamps))
    assert controller.get("output_int_register_0") == (0,)
    controller.faults.creep = False
    controller.advance()
    assert float(controller.get("timestamp")[0]) - stamps[-1] == pytest.approx(0.002, abs=1e-6)


def test_freeze_stops_the_timestamp_and_the_program_but_not_the_cycles() -> None:
    controller = Controller(program=parse("output_int_register_0 = count every 2ms"))
    controller.advance()
    controller.faults.freeze = True
    before = (
        controller.step,
        controller.get("output_int_register_0"),
        controller.get("actual_q"),
        controller.cycle,
    )
    controller.advance()
    after = (
        controller.step,
        controller.get("output_int_register_0"),
        controller.get("actual_q"),
        controller.cycle - 1,
    )
    assert after == before


def test_the_speed_slider_slows_the_arm_and_a_stopped_program_halts_it() -> None:
    controller = Controller(program=parse("output_int_register_0 = count every 2ms"))
    controller.advance()
    full = controller.get("target_qd")
    controller.set("target_speed_fraction", (0.5,))
    controller.advance()
    assert controller.get("target_qd") == pytest.approx([speed / 2 for speed in full], rel=0.02)
    controller.set("runtime_state", (1,))
    count = controller.get("output_int_register_0")
    controller.advance()
    assert not any(controller.get("target_qd"))
    assert controller.get("output_int_register_0") == count
    assert controller.get("robot_status_bits") == (0b01,)


@pytest.mark.parametrize("fraction", [math.nan, math.inf, -1.0])
def test_an_impossible_speed_does_not_derail_the_arm(fraction: float) -> None:
    controller = Controller()
    controller.set("target_speed_fraction", (fraction,))
    controller.advance()
    assert all(map(math.isfinite, controller.get("actual_q") + controller.get("encoder0_raw")))


def test_a_restart_begins_again() -> None:
    controller = Controller(program=parse("output_int_register_0 = count every 2ms"))
    controller.set("input_int_register_0", (5,))
    controller.advance()
    controller.restart()
    assert controller.get("timestamp") == (0.0,)
    assert (controller.get("input_int_register_0"), controller.get("output_int_register_0")) == ((0,), (0,))


def test_a_controller_that_will_restart_has_just_been_started() -> None:
    assert Controller(faults=Faults(boot_restart=1.0)).get("timestamp") == (0.0,)
    assert Controller(uptime=7.0, faults=Faults(boot_restart=1.0)).get("timestamp") == (7.0,)


def test_an_adapter_holds_what_the_version_has() -> None:
    controller = Controller(faults=Faults(adapter="profinet"))
    assert set(controller.claims.held("PROFINET adapter")) == set(ADAPTER_FIELDS)
    controller.free(["input_int_register_3"])
    assert controller.claims.owner("input_int_register_3") is None


def test_hold_and_free() -> None:
    controller = Controller(faults=Faults(hold=("input_int_register_3",)))
    assert controller.claims.owner("input_int_register_3") == INTERNAL
    controller.claims.claim("a client", ["input_int_register_4"])
    with pytest.raises(ValueError, match="input_int_register_4 is in use by a client"):
        controller.hold(["input_int_register_4"])
    with pytest.raises(ValueError, match="input_int_register_4 is in use by a client"):
        controller.free(["input_int_register_4"])
    with pytest.raises(ValueError, match="input_int_register_5 is not held"):
        controller.free(["input_int_register_5"])
    with pytest.raises(ValueError, match="no such input: output_int_register_0"):
        controller.hold(["output_int_register_0"])


def test_the_cycle_counters_cannot_be_set() -> None:
    with pytest.raises(ValueError, match="timestamp follows the controller's cycles"):
        Controller().set("timestamp", (0.0,))


def test_a_controller_may_have_fields_that_the_catalogue_does_not_have() -> None:
    fields = [Field("dexterity", DataType.VECTOR3D, ""), Field("robot_mode", DataType.UINT8, "")]
    controller = Controller(fields=fields)
    assert controller.output_type("dexterity") is DataType.VECTOR3D
    assert controller.output_type("robot_mode") is DataType.UINT8
    assert Controller().output_type("dexterity") is None
    controller.set("dexterity", (1, 2, 3))
    assert controller.get("dexterity") == (1.0, 2.0, 3.0)
    controller.restart()
    assert controller.get("dexterity") == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("name", ["timestamp", "input_int_register_0"])
def test_inputs_and_the_clock_are_what_they_are(name: str) -> None:
    with pytest.raises(ValueError, match=f"{name} cannot be another field"):
        Controller(fields=[Field(name, DataType.DOUBLE, "")])
