"""What a release does to actuators that act through a mask: every family, every cause, looked at in the robot."""

from __future__ import annotations

import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, replace

import pytest

from gatewayd.core.admission import Change
from gatewayd.core.definition import CellDefinition
from gatewayd.core.freshness import Source
from gatewayd.core.requester import Requester
from gatewayd.core.succession import succeed
from gatewayd.links.robot.declaration import KIND
from gatewayd.links.robot.plan import robot_of
from gatewayd.simulator.server import SimulatedController
from tests.links.robot.rig import HMI, PLC, Rig, linked, plan_for, rigged

Until = Callable[..., Awaitable[None]]
VALUE, MASK = 0, 1


@dataclass(frozen=True)
class Family:
    """Variables of one masked family; the first is the value, the second its mask."""

    variables: str
    write: tuple[tuple[int, bool | int | float], ...]
    mask: str
    actuator: str
    driven: float
    released: float
    bits: int | None = None
    """Bits of the actuator field to look at."""
    prepare: tuple[tuple[str, float], ...] = ()

    def look(self, robot: SimulatedController) -> float:
        """What the actuator does."""
        value = robot.get(self.actuator)
        assert not isinstance(value, tuple)
        return value if self.bits is None else int(value) & self.bits


def digital(kind: str, bit: int, shift: int, *, value: str = "bit", mask: str = "bit") -> Family:
    """One output of a kind, each of its two fields mapped bit by bit or as a whole integer."""
    number = 1 << bit
    places = {"bit": (f".{bit}", f"0.{bit}", f"1.{bit}"), "whole": ("", "0", "1")}
    wide = value == "whole"
    return Family(
        f"  value: {{robot: {kind}_digital_output{places[value][0]}, modbus: {places[value][1]}}}\n"
        f"  mask: {{robot: {kind}_digital_output_mask{places[mask][0]}, modbus: {places[mask][2]}}}\n",
        ((VALUE, number if wide else True), (MASK, number if mask == "whole" else True)),
        f"{kind}_digital_output_mask",
        "actual_digital_output_bits",
        number << shift,
        0,
        0xFF << shift,
    )


ANALOG = """\
  value: {robot: standard_analog_output_0, modbus: {holding: 0, type: float32}}
  mask:  {robot: standard_analog_output_mask.0, modbus: 4.0}
"""
TYPE = "  type:  {robot: standard_analog_output_type.0, modbus: 5.0}\n"
SLIDER = """\
  value: {robot: speed_slider_fraction, modbus: {holding: 0, type: float32}, on_release: 0.25, limits: [0.1, 1]}
  mask:  {robot: speed_slider_mask.0, modbus: 4.0}
"""
FAMILIES = {
    "standard": digital("standard", 3, 0),
    "configurable": digital("configurable", 5, 8),
    "tool": digital("tool", 1, 16),
    "whole integers": digital("standard", 3, 0, value="whole", mask="whole"),
    "whole value, mask bit": digital("standard", 3, 0, value="whole"),
    "value bit, whole mask": digital("configurable", 2, 8, mask="whole"),
    "speed slider": Family(
        SLIDER, ((VALUE, 0.5), (MASK, True)), "speed_slider_mask", "target_speed_fraction", 0.5, 0.25
    ),
    "analog in volts": Family(
        ANALOG + TYPE,
        ((VALUE, 0.5), (MASK, True), (2, True)),
        "standard_analog_output_mask",
        "standard_analog_output0",
        5.0,
        0.0,
    ),
    "analog in the robot's own domain": Family(
        ANALOG,
        ((VALUE, 0.5), (MASK, True)),
        "standard_analog_output_mask",
        "standard_analog_output0",
        5.0,
        0.0,
        prepare=(("analog_io_types", 0b0100),),
    ),
}


async def connection_lost(rig: Rig, _until: Until) -> None:
    rig.cell.writer_disconnected(Requester(PLC), time.monotonic(), "gone")


async def lease_ends(rig: Rig, _until: Until) -> None:
    rig.cell.tick(time.monotonic() + 3600)


async def writer_releases(rig: Rig, _until: Until) -> None:
    rig.cell.release_all(Requester(PLC), time.monotonic())


async def another_takes_over(rig: Rig, _until: Until) -> None:
    for index in rig.cell.image.inputs:
        assert rig.cell.request(Requester(HMI), index, time.monotonic()) is None


async def operator_frees(rig: Rig, _until: Until) -> None:
    for lock in range(len(rig.cell.definition.locks)):
        rig.cell.operator.free_lock(lock, time.monotonic())


async def force_ends(rig: Rig, _until: Until) -> None:
    """The operator has forced the very values that the PLC wrote."""
    now = time.monotonic()
    for index, value in enumerate(rig.cell.image.values[: len(rig.cell.image.inputs)]):
        assert rig.cell.operator.force(index, value, now, now + 100) is None
    for index in rig.cell.image.inputs:
        rig.cell.operator.unforce(index, now)


async def gateway_stops(rig: Rig, until: Until) -> None:
    """Ended at once afterwards: what is not sent by then never is."""
    rig.cell.stop(time.monotonic(), "the gateway stops")
    await rig.link.close()
    rig.task.cancel()
    await until(rig.task.done)


async def mapping_removes_the_writer(rig: Rig, _until: Until) -> None:
    """A reload that keeps the session; nobody may write these variables any more."""
    now = time.monotonic()
    definition = rig.cell.definition
    locks = tuple(replace(lock, owners=(HMI,)) for lock in definition.locks)
    rig.cell, old = succeed(rig.cell, replace(definition, locks=locks), now).cell, rig.cell
    rig.link.flush(now)
    old.listeners.clear()
    assert KIND.fits(rig.link.plan, rig.link.plan, old.definition, rig.cell.definition)
    rig.link.rebind(rig.link.plan, rig.cell, now)


async def mapping_removes_the_variables(rig: Rig, until: Until) -> None:
    """A reload that needs another session."""
    now = time.monotonic()
    rig.link.flush(now)
    plan = plan_for(rig.robot.port, "  number: {robot: input_int_register_0, modbus: 0}\n")
    rig.cell, old = succeed(rig.cell, plan.cell, now).cell, rig.cell
    rig.link.flush(now)
    old.listeners.clear()
    assert not KIND.fits(rig.link.plan, robot_of(plan), old.definition, rig.cell.definition)
    rig.task.cancel()
    await until(rig.task.done)


async def session_lost_meanwhile(rig: Rig, until: Until) -> None:
    """The connection is cut in the moment of the release: it is due again in the next session."""
    sessions = rig.cell.health.sessions
    rig.robot.drop_clients()
    rig.cell.writer_disconnected(Requester(PLC), time.monotonic(), "gone")
    await until(lambda: rig.cell.health.sessions > sessions and rig.cell.accepts_writes)


async def owner_lost_while_the_robot_is(rig: Rig, until: Until) -> None:
    sessions = rig.cell.health.sessions
    rig.robot.drop_clients()
    await until(lambda: rig.cell.freshness.state is Source.LOST)
    rig.cell.writer_disconnected(Requester(PLC), time.monotonic(), "gone")
    await until(lambda: rig.cell.health.sessions > sessions and rig.cell.accepts_writes)


CAUSES = [
    connection_lost,
    lease_ends,
    writer_releases,
    another_takes_over,
    operator_frees,
    force_ends,
    gateway_stops,
    mapping_removes_the_writer,
    mapping_removes_the_variables,
    session_lost_meanwhile,
    owner_lost_while_the_robot_is,
]
Cause = Callable[[Rig, Until], Awaitable[None]]


class Recorder:
    """What mask and actuator were in every control cycle."""

    def __init__(self, robot: SimulatedController, family: Family) -> None:
        self.seen: list[tuple[int, float]] = []
        advance = robot.controller.advance

        def recorded(cycles: int = 1) -> None:
            mask = robot.get(family.mask)
            assert not isinstance(mask, tuple)
            self.seen.append((int(mask), family.look(robot)))
            advance(cycles)

        robot.controller.advance = recorded  # type: ignore[method-assign]

    def assert_released(self, family: Family) -> None:
        """The fallback acted, and only in a later cycle the mask was cleared; nothing else was ever driven."""
        staged = [n for n, (mask, value) in enumerate(self.seen) if mask and value == family.released]
        cleared = [n for n, (mask, _value) in enumerate(self.seen) if not mask and staged and n > staged[-1]]
        assert staged, self.seen[-5:]
        assert cleared, self.seen[-5:]
        assert {value for _mask, value in self.seen[staged[0] :]} == {family.released}
        assert {value for _mask, value in self.seen[: staged[0]]} <= {family.driven, family.released}


def prepared(family: Family) -> Callable[[SimulatedController], None]:
    def prepare(robot: SimulatedController) -> None:
        for name, value in family.prepare:
            robot.set(name, value)

    return prepare


async def drive(rig: Rig, family: Family, until: Until) -> None:
    """The PLC has its way."""
    await until(lambda: rig.cell.accepts_writes)
    rig.cell.writer_connected(Requester(PLC), time.monotonic())
    rig.write(*family.write)
    await until(lambda: family.look(rig.robot) == family.driven)


@pytest.mark.parametrize("family", FAMILIES.values(), ids=FAMILIES)
@pytest.mark.parametrize("cause", CAUSES)
async def test_a_release_reaches_the_actuator(family: Family, cause: Cause, until: Until) -> None:
    def leased(definition: CellDefinition) -> CellDefinition:
        locks = [replace(lock, lease=600.0, owners=(HMI, PLC), takeover=True) for lock in definition.locks]
        return replace(definition, locks=tuple(locks))

    async with rigged(family.variables, prepare=prepared(family), definition=leased) as rig:
        await drive(rig, family, until)
        recorder = Recorder(rig.robot, family)
        await cause(rig, until)
        await until(lambda: recorder.seen[-1:] == [(0, family.released)])
        recorder.assert_released(family)
        if rig.cell.accepts_writes:
            values = rig.cell.image.values
            assert values[VALUE] == rig.cell.definition.variables[VALUE].on_release.apply(
                values[VALUE], rig.cell.definition.variables[VALUE].kind
            )


@pytest.mark.parametrize("family", FAMILIES.values(), ids=FAMILIES)
@pytest.mark.parametrize("policy", ["on_connect: fallback", "adopt_for: 50ms"])
async def test_what_a_killed_gateway_left_behind_falls_back(
    family: Family, policy: str, until: Until
) -> None:
    """Another process: nobody knows what was driven, so every mapped output falls back."""
    async with rigged(family.variables, prepare=prepared(family)) as rig:
        await drive(rig, family, until)
        rig.task.cancel()
        await until(rig.task.done)
        assert family.look(rig.robot) == family.driven
        recorder = Recorder(rig.robot, family)
        plan = plan_for(rig.robot.port, family.variables)
        wanted = {"clear_on_connect": True} if policy.startswith("on_connect") else {"adopt_for": 0.05}
        async with linked(rig.robot, replace(plan, cell=replace(plan.cell, **wanted))) as other:
            other.cell.adoption.reachable = True

            def released() -> bool:
                other.cell.tick(time.monotonic())
                return recorder.seen[-1:] == [(0, family.released)]

            await until(released)
            recorder.assert_released(family)


MASK_BY_ANOTHER = Family(
    "  value: {robot: standard_digital_output.3, modbus: 0.3, owner: plc}\n"
    "  mask: {robot: standard_digital_output_mask.3, modbus: 1.3, owner: hmi, on_release: hold}\n",
    ((VALUE, True),),
    "standard_digital_output_mask",
    "actual_digital_output_bits",
    8,
    0,
)


async def test_a_mask_of_another_writer_stays_his(until: Until) -> None:
    async with rigged(MASK_BY_ANOTHER.variables) as rig:
        await until(lambda: rig.cell.accepts_writes)
        rig.write((MASK, True), writer=HMI)
        rig.write((VALUE, True))
        await until(lambda: rig.get("actual_digital_output_bits") == 8)
        rig.cell.writer_connected(Requester(PLC), time.monotonic())
        rig.cell.writer_disconnected(Requester(PLC), time.monotonic(), "gone")
        await until(lambda: rig.get("actual_digital_output_bits") == 0)
        await until(lambda: not rig.link._inputs.is_releasing)
        assert rig.get("standard_digital_output_mask") == 8
        assert rig.cell.image.values[MASK] is True


@pytest.mark.parametrize("family", FAMILIES.values(), ids=FAMILIES)
async def test_a_mask_that_its_owner_had_cleared_is_set_for_the_release(family: Family, until: Until) -> None:
    async with rigged(family.variables, prepare=prepared(family)) as rig:
        await drive(rig, family, until)
        rig.write((MASK, 0 if family.write[MASK][1] is not True else False))
        await until(lambda: rig.get(family.mask) == 0)
        assert family.look(rig.robot) == family.driven
        recorder = Recorder(rig.robot, family)
        await connection_lost(rig, until)
        await until(lambda: recorder.seen[-1:] == [(0, family.released)])
        recorder.assert_released(family)


async def test_whole_integers_release_only_what_they_drove(until: Until) -> None:
    """Another output, which the robot program has set, is none of the writer's business."""
    family = FAMILIES["whole integers"]

    async def release(rig: Rig) -> None:
        await connection_lost(rig, until)
        await until(lambda: not rig.cell.delivery.under_way)

    async with rigged(family.variables) as rig:
        await drive(rig, family, until)
        rig.robot.set("actual_digital_output_bits", 0b1001)
        await release(rig)
        assert rig.get("actual_digital_output_bits") == 0, "what was driven before the start is not known"
        await drive(rig, family, until)
        rig.robot.set("actual_digital_output_bits", 0b1001)
        await release(rig)
        assert rig.get("actual_digital_output_bits") == 1
        rig.cell.writer_connected(Requester(PLC), time.monotonic())
        rig.write((VALUE, 0))
        await release(rig)
        assert rig.get("actual_digital_output_bits") == 1, "nothing was driven since"


async def test_a_write_during_a_release_waits_for_its_end(until: Until) -> None:
    """It would act through the mask of the release, which its writer did not set."""
    family = FAMILIES["standard"]
    async with rigged(family.variables) as rig:
        await drive(rig, family, until)
        recorder = Recorder(rig.robot, family)
        await connection_lost(rig, until)
        rig.write((VALUE, True))
        await until(lambda: recorder.seen[-1:] == [(0, 0)] and rig.get("standard_digital_output") == 8)
        recorder.assert_released(family)


async def test_a_mask_bit_acts_only_with_a_value_of_this_session(until: Until) -> None:
    """The image may hold what was written in a former session: nothing of it is ever sent."""
    family = FAMILIES["speed slider"]
    async with rigged(family.variables) as rig:
        await drive(rig, family, until)
        sessions = rig.cell.health.sessions
        rig.robot.drop_clients()
        await until(lambda: rig.cell.health.sessions > sessions and rig.cell.accepts_writes)
        rig.robot.set("target_speed_fraction", 0.75)
        rig.write((MASK, True))
        writes = rig.link._client.statistics.writes
        await until(lambda: rig.link._client.statistics.writes >= writes)
        packages = rig.cell.health.packages
        await until(lambda: rig.cell.health.packages > packages + 20)
        assert rig.get("target_speed_fraction") == 0.75
        rig.write((VALUE, 0.5))
        await until(lambda: rig.get("target_speed_fraction") == 0.5)


async def test_an_analog_output_without_a_domain_is_not_there(until: Until) -> None:
    """0.5 meant as 5 V would be 12 mA: the type is held by somebody else."""
    async with rigged(
        ANALOG, prepare=lambda robot: robot.controller.hold(["standard_analog_output_type"])
    ) as rig:
        await until(lambda: rig.cell.accepts_writes)
        assert not rig.cell.image.available[VALUE]
        refusal = rig.cell.write(Requester(PLC), [Change(VALUE, 0.5)], time.monotonic())
        assert refusal is not None
        rig.robot.controller.free(["standard_analog_output_type"])
        await until(lambda: rig.cell.image.available[VALUE])
