"""The link between a cell and a simulated controller: adoption, sending, checking, and what a loss leaves."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Awaitable, Callable
from functools import partial

import pytest

from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.definition import Direction
from gatewayd.core.events import EventKind
from gatewayd.core.freshness import Source
from gatewayd.core.image import Quality
from gatewayd.core.refusal import Reason
from gatewayd.core.requester import Requester
from gatewayd.core.succession import succeed
from gatewayd.links.robot import readback as readback_module
from gatewayd.links.robot.declaration import KIND
from gatewayd.links.robot.plan import robot_of
from gatewayd.rtde.fields import SoftwareVersion
from gatewayd.simulator.server import SimulatedController
from tests.links.robot.rig import HMI, PLC, Defect, Rig, Rigged, plan_for
from tests.links.robot.rig import rigged as joined

Until = Callable[..., Awaitable[None]]

REGISTERS = """\
  bit:    {robot: input_bit_register_3,    modbus: 0.3}
  number: {robot: input_int_register_0,    modbus: 1}
  real:   {robot: input_double_register_0, modbus: 3, on_release: hold}
  echo:   {robot: output_int_register_0,   modbus: 100}
  lamp:   {robot: output_bit_register_3,   modbus: 102.3}
"""
BIT, NUMBER, REAL, ECHO, LAMP = range(5)


@pytest.fixture
def rigged() -> Rigged:
    """A rig; of the registers above unless told otherwise."""
    return partial(joined, REGISTERS)


async def test_what_the_controller_holds_is_adopted_and_not_overwritten(rigged: Rigged, until: Until) -> None:
    def prepare(robot: SimulatedController) -> None:
        robot.set("input_bit_registers0_to_31", 0x80000009)
        robot.set("input_int_register_0", -5)
        robot.set("input_double_register_0", 2.5)

    async with rigged(prepare=prepare) as rig:
        await until(lambda: rig.cell.accepts_writes)
        assert rig.cell.image.values[:3] == [True, -5, 2.5]
        assert rig.cell.image.quality[:3] == [Quality.GOOD] * 3
        rig.write((BIT, False))
        await until(lambda: rig.get("input_bit_registers0_to_31") == 0x80000001)
        assert (rig.get("input_int_register_0"), rig.get("input_double_register_0")) == (-5, 2.5)


async def test_nothing_is_sent_before_something_is_written(rigged: Rigged, until: Until) -> None:
    """Another tool may set a register between the adoption and the first write: it stays."""
    async with rigged() as rig:
        await until(lambda: rig.cell.accepts_writes)
        rig.robot.set("input_int_register_0", 99)
        await until(lambda: rig.cell.health.packages > 20)
        assert rig.get("input_int_register_0") == 99


async def test_outputs_are_copied_bits_and_numbers(rigged: Rigged, until: Until) -> None:
    async with rigged() as rig:
        await until(lambda: rig.cell.accepts_writes)
        rig.write((BIT, True), (NUMBER, -(2**31)))
        await until(lambda: rig.cell.image.values[ECHO] == -(2**31))
        assert rig.cell.image.values[LAMP] is True
        rig.write((BIT, False))
        await until(lambda: rig.cell.image.values[LAMP] is False)


async def test_values_of_one_request_arrive_in_one_package(rigged: Rigged, until: Until) -> None:
    async with rigged() as rig:
        await until(lambda: rig.cell.accepts_writes)
        torn: list[tuple[object, object]] = []
        seen: set[object] = set()

        def look(_direction: Direction) -> None:
            number, real = rig.get("input_int_register_0"), rig.get("input_double_register_0")
            seen.add(number)
            if number != real:
                torn.append((number, real))

        rig.cell.listeners.append(look)
        for number in range(200):
            rig.write((NUMBER, number), (REAL, float(number)))
            if number % 3 == 0:
                await asyncio.sleep(0.001)
        await until(lambda: rig.get("input_int_register_0") == 199)
        assert not torn
        assert len(seen) > 10


async def test_at_most_one_package_per_controller_cycle(rigged: Rigged, until: Until) -> None:
    async with rigged() as rig:
        await until(lambda: rig.cell.accepts_writes)
        before, start = rig.link._client.statistics.writes, time.monotonic()
        for number in range(1000):
            rig.write((NUMBER, number))
        await until(lambda: rig.get("input_int_register_0") == 999)
        sent = rig.link._client.statistics.writes - before
        assert 2 <= sent <= 2 + (time.monotonic() - start) / 0.002


async def test_an_equal_value_written_again_is_sent_again(rigged: Rigged, until: Until) -> None:
    """The writer means it: what the robot holds may have been changed by somebody else."""
    async with rigged() as rig:
        await until(lambda: rig.cell.accepts_writes)
        rig.write((NUMBER, 7))
        await until(lambda: rig.get("input_int_register_0") == 7)
        rig.robot.set("input_int_register_0", 1)
        rig.write((NUMBER, 7))
        await until(lambda: rig.get("input_int_register_0") == 7)


@pytest.mark.parametrize("value", [math.inf, -0.0, math.nan, 5e-324])
async def test_doubles_keep_every_bit(rigged: Rigged, until: Until, value: float) -> None:
    def held(rig: Rig) -> str:
        return repr(rig.get("input_double_register_0"))

    async with rigged() as rig:
        await until(lambda: rig.cell.accepts_writes)
        rig.write((REAL, value))
        await until(lambda: held(rig) == repr(value))
        await asyncio.sleep(0)
        assert not rig.events(EventKind.READ_BACK_DIFFERS)


CYCLIC = pytest.mark.parametrize("cyclic", [False, True], ids=["written once", "written in every PLC cycle"])


@CYCLIC
async def test_a_value_that_does_not_arrive_is_told_once(
    rigged: Rigged, until: Until, monkeypatch: pytest.MonkeyPatch, cyclic: bool
) -> None:
    """Also while the PLC writes another variable, or the same value, again and again."""
    monkeypatch.setattr(readback_module, "VERIFY_AFTER", 0.1)
    async with rigged() as rig:
        await until(lambda: rig.cell.accepts_writes)
        rig.write((NUMBER, 7), (REAL, 1.0))
        await until(lambda: rig.get("input_int_register_0") == 7)
        _make_stubborn(rig.robot)
        end = time.monotonic() + 0.6
        real = 1.0
        while time.monotonic() < end:
            if cyclic:
                real += 1
                rig.write((NUMBER, 7), (REAL, real))
            await asyncio.sleep(0.01)
        told = rig.events(EventKind.READ_BACK_DIFFERS)
        assert told == ["input_int_register_0: sent 7, the controller holds 8"]
        assert rig.cell.health.read_back_mismatches == 1


def _make_stubborn(robot: SimulatedController) -> None:
    """From now on something in the controller puts 8 into the register in every cycle."""
    advance = robot.controller.advance

    def altered(cycles: int = 1) -> None:
        robot.set("input_int_register_0", 8)
        advance(cycles)

    robot.controller.advance = altered  # type: ignore[method-assign]


IO = """\
  slider:  {robot: speed_slider_fraction, modbus: {holding: 0, type: float32}, on_release: hold, limits: [0.1, 1]}
  mask:    {robot: speed_slider_mask,     modbus: 2, on_release: hold}
  number:  {robot: input_int_register_0,  modbus: 4}
"""


async def test_an_input_that_the_controller_does_not_tell_is_not_good_before_it_is_written(
    until: Until,
) -> None:
    async with joined(IO) as rig:
        await until(lambda: rig.cell.accepts_writes)
        assert rig.cell.image.quality == [Quality.NEVER, Quality.NEVER, Quality.GOOD]
        rig.write((0, 0.5), (1, 1))
        assert rig.cell.image.quality == [Quality.GOOD] * 3
        await until(lambda: rig.get("target_speed_fraction") == 0.5)


async def test_a_new_session_sends_nothing_that_nobody_wrote_in_it(until: Until) -> None:
    """What cannot be read back would else be sent as it was before the loss, over what was set meanwhile."""
    async with joined(IO) as rig:
        await until(lambda: rig.cell.accepts_writes)
        rig.write((0, 0.5), (1, 1))
        await until(lambda: rig.get("target_speed_fraction") == 0.5)
        sessions, writes = rig.cell.health.sessions, rig.link._client.statistics.writes
        rig.robot.drop_clients()
        rig.robot.set("target_speed_fraction", 0.75)
        await until(lambda: rig.cell.health.sessions > sessions and rig.cell.accepts_writes)
        packages = rig.cell.health.packages
        await until(lambda: rig.cell.health.packages > packages + 5)
        assert rig.link._client.statistics.writes == writes
        assert rig.get("target_speed_fraction") == 0.75
        assert rig.cell.image.quality == [Quality.STALE, Quality.STALE, Quality.GOOD]


async def test_registers_freed_later_are_adopted_and_lose_no_write(rigged: Rigged, until: Until) -> None:
    """Writes to the others go on meanwhile; the freed one is taken over as it is."""

    def prepare(robot: SimulatedController) -> None:
        robot.controller.hold(["input_double_register_0"])
        robot.set("input_double_register_0", 4.5)

    async with rigged(prepare=prepare) as rig:
        await until(lambda: rig.cell.accepts_writes)
        assert not rig.cell.image.available[REAL]
        rig.robot.controller.free(["input_double_register_0"])
        number = 0
        while not rig.cell.image.available[REAL]:
            number += 1
            rig.write((NUMBER, number))
            await asyncio.sleep(0)
        rig.write((NUMBER, number + 1))
        assert rig.cell.image.values[REAL] == 4.5
        await until(lambda: rig.get("input_int_register_0") == number + 1)
        assert rig.get("input_double_register_0") == 4.5
        rig.write((REAL, 1.5))
        await until(lambda: rig.get("input_double_register_0") == 1.5)


OLD = """\
  number: {robot: input_int_register_0,   modbus: 0}
  upper:  {robot: input_int_register_24,  modbus: 2}
  echo:   {robot: output_int_register_0,  modbus: 100}
  late:   {robot: output_int_register_24, modbus: 102, on_stale: -1}
"""


async def test_what_an_old_controller_lacks_costs_only_itself(until: Until) -> None:
    """Registers from 24 on came with 5.3; the reason is the controller's word."""
    async with joined(OLD, version=SoftwareVersion(5, 1, 0)) as rig:
        await until(lambda: rig.cell.accepts_writes)
        assert rig.cell.image.quality == [
            Quality.GOOD,
            Quality.UNAVAILABLE,
            Quality.GOOD,
            Quality.UNAVAILABLE,
        ]
        rig.write((0, 5))
        await until(lambda: rig.cell.image.values == [5, 0, 5, -1])
        refusal = rig.cell.write(Requester(PLC), [Change(1, 5)], time.monotonic())
        assert refusal is not None
        assert refusal.reason is Reason.CLAIMED_ELSEWHERE
        told = rig.events(EventKind.UNAVAILABLE)
        assert len(told) == 2
        assert all(line.startswith("NOT_FOUND: ") for line in told)


async def test_checking_can_be_switched_off(
    rigged: Rigged, until: Until, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(readback_module, "VERIFY_AFTER", 0.0)
    async with rigged(options=", verify: false") as rig:
        await until(lambda: rig.cell.accepts_writes)
        _make_stubborn(rig.robot)
        rig.write((NUMBER, 7))
        packages = rig.cell.health.packages
        await until(lambda: rig.cell.health.packages > packages + 20)
        assert not rig.events(EventKind.READ_BACK_DIFFERS)


async def test_a_defect_behind_a_callback_counts_as_a_loss(rigged: Rigged, until: Until) -> None:
    """Nobody may believe in a robot whose link has ended."""
    async with rigged() as rig:
        await until(lambda: rig.cell.accepts_writes)

        def fail(_direction: Direction) -> None:
            raise Defect

        rig.cell.listeners.insert(0, fail)
        await until(lambda: rig.cell.freshness.state is not Source.FRESH)
        assert not rig.cell.accepts_writes
        assert rig.cell.freshness.state is Source.LOST


async def test_the_same_failure_is_told_once(
    rigged: Rigged, until: Until, caplog: pytest.LogCaptureFixture
) -> None:
    async with rigged() as rig:
        await until(lambda: rig.cell.accepts_writes)
        await rig.robot.stop()
        await until(lambda: rig.cell.freshness.state is Source.LOST)
        await until(lambda: len([r for r in caplog.records if r.message == "no robot"]) == 1)
        await asyncio.sleep(0.3)
        assert len([r for r in caplog.records if r.message == "no robot"]) == 1
        await rig.robot.start()
        await until(lambda: rig.cell.accepts_writes)


async def test_a_package_that_cannot_be_taken_is_counted_and_logged_once(
    rigged: Rigged, until: Until, caplog: pytest.LogCaptureFixture
) -> None:
    async with rigged() as rig:
        await until(lambda: rig.cell.accepts_writes)
        for count in (1, 2, 3):
            rig.robot.raw(bytes.fromhex("0004 63 00"))
            await until(lambda: rig.link.health().figures["strange"]["unknown type"] == count)  # type: ignore[index]  # noqa: B023
        lines = [record for record in caplog.records if record.message == "strange package"]
        assert [line.fields["reason"] for line in lines] == ["unknown package type 99: 00 04 63 00"]  # type: ignore[attr-defined]
        assert rig.cell.health.sessions == 1


async def test_what_is_due_is_sent_before_the_end(rigged: Rigged, until: Until) -> None:
    async with rigged() as rig:
        await until(lambda: rig.cell.accepts_writes)
        for number in range(50):
            rig.write((NUMBER, number))
        await rig.link.close()
        robot = rig.robot
        await until(lambda: robot.get("input_int_register_0") == 49)


WATCHDOG = ", watchdog: {field: input_int_register_9, frequency: 50, requires: [plc]}"


async def test_the_watchdog_is_fed_for_living_writers_only(rigged: Rigged, until: Until) -> None:
    async with rigged(options=WATCHDOG) as rig:
        await until(lambda: rig.cell.accepts_writes)
        now = time.monotonic
        rig.cell.writer_connected(Requester(HMI), now())
        await asyncio.sleep(0.1)
        assert not rig.cell.health.watchdog_fed
        rig.cell.writer_connected(Requester(PLC), now())
        await until(lambda: rig.cell.health.watchdog_fed)
        fed = int(str(rig.get("input_int_register_9")))
        await until(lambda: int(str(rig.get("input_int_register_9"))) > fed + 3)
        rig.cell.writer_disconnected(Requester(PLC), now(), "gone")
        await until(lambda: not rig.cell.health.watchdog_fed)
        await rig.link.close()


def rebound(rig: Rig, variables: str, options: str = "") -> Cell | None:
    """The cell that went on with these variables, by the same link; None if that takes another session."""
    plan = plan_for(rig.robot.port, variables, options)
    if not KIND.fits(rig.link.plan, robot_of(plan), rig.cell.definition, plan.cell):
        return None
    now = time.monotonic()
    new = succeed(rig.cell, plan.cell, now).cell
    rig.link.flush(now)
    rig.link.rebind(robot_of(plan), new, now)
    rig.cell = new
    return new


async def test_another_cell_goes_on_by_the_same_session(rigged: Rigged, until: Until) -> None:
    """Another order, other limits, another name: values flow both ways at once, and nothing is sent by it."""
    async with rigged() as rig:
        await until(lambda: rig.cell.accepts_writes)
        rig.write((NUMBER, 7), (BIT, True))
        await until(lambda: rig.cell.image.values[ECHO] == 7)
        former, sent = rig.cell, rig.link._client.statistics.writes
        lines = REGISTERS.splitlines(keepends=True)
        new = rebound(rig, "".join(reversed(lines)).replace("real:", "other:"))
        assert new is not None
        assert [one.name for one in new.definition.variables] == ["lamp", "echo", "other", "number", "bit"]
        assert new.image.values[1:] == [7, 0.0, 7, True]
        assert new.image.quality[2] is Quality.GOOD, "what the controller was last given is known"
        assert not former.listeners
        assert rig.link._client.statistics.writes == sent
        rig.write((3, 8))
        await until(lambda: rig.get("input_int_register_0") == 8)
        await until(lambda: new.image.values[1] == 8)
        assert rig.get("input_bit_registers0_to_31") == 8
        assert new.health.sessions == 1


@pytest.mark.parametrize(
    "variables, options",
    [
        (REGISTERS + "  more: {robot: input_int_register_1, modbus: 10}\n", ""),
        (REGISTERS + "  more: {robot: output_int_register_1, modbus: 110}\n", ""),
        (REGISTERS.replace("  real:", "  #"), ""),
        (REGISTERS, ", frequency: 20"),
        (REGISTERS, WATCHDOG),
    ],
    ids=["input added", "output added", "input removed", "frequency", "watchdog"],
)
async def test_what_the_session_cannot_carry_needs_another(
    rigged: Rigged, until: Until, variables: str, options: str
) -> None:
    async with rigged() as rig:
        await until(lambda: rig.cell.accepts_writes)
        assert rebound(rig, variables, options) is None


async def test_a_link_without_a_session_goes_on_too(rigged: Rigged, until: Until) -> None:
    async with rigged() as rig:
        await until(lambda: rig.cell.accepts_writes)
        await rig.robot.stop()
        await until(lambda: rig.cell.freshness.state is Source.LOST)
        assert rebound(rig, REGISTERS.replace("on_release: hold", "on_release: 4")) is not None
        await rig.robot.start()
        await until(lambda: rig.cell.accepts_writes)
        rig.write((NUMBER, 9))
        await until(lambda: rig.get("input_int_register_0") == 9)


# -- what may be sent, and when --------------------------------------------------------------------------------------


async def test_writes_go_on_while_new_registers_wait_for_a_clock_that_stands_still(
    rigged: Rigged, until: Until
) -> None:
    """And so do releases; the new register is unavailable until it was read."""

    def prepare(robot: SimulatedController) -> None:
        robot.controller.hold(["input_double_register_0"])
        robot.set("input_double_register_0", 4.5)

    async with rigged(prepare=prepare) as rig:
        await until(lambda: rig.cell.accepts_writes)
        rig.cell.writer_connected(Requester(PLC), time.monotonic())
        rig.robot.faults.freeze = True
        rig.robot.controller.free(["input_double_register_0"])
        await until(lambda: not rig.link.settled)
        rig.write((NUMBER, 7), (BIT, True))
        await until(lambda: rig.get("input_int_register_0") == 7)
        refusal = rig.cell.write(Requester(PLC), [Change(REAL, 1.0)], time.monotonic())
        assert refusal is not None
        assert refusal.reason is Reason.CLAIMED_ELSEWHERE
        rig.cell.writer_disconnected(Requester(PLC), time.monotonic(), "gone")
        await until(lambda: rig.get("input_int_register_0") == 0)
        assert not rig.link.settled, "the clock still stands"
        rig.write((NUMBER, 9))
        rig.cell.stop(time.monotonic(), "the gateway stops")
        await rig.link.close()
        await until(lambda: rig.get("input_int_register_0") == 0)
        assert rig.get("input_double_register_0") == 4.5


async def test_a_reload_in_that_moment_swallows_nothing(rigged: Rigged, until: Until) -> None:
    async with rigged(prepare=lambda robot: robot.controller.hold(["input_double_register_0"])) as rig:
        await until(lambda: rig.cell.accepts_writes)
        rig.robot.faults.freeze = True
        rig.robot.controller.free(["input_double_register_0"])
        await until(lambda: not rig.link.settled)
        for number in range(20):
            rig.write((NUMBER, number))
        assert rebound(rig, REGISTERS.replace("lamp:", "light:")) is not None
        assert not rig.cell.image.available[REAL], "it was not read yet"
        await until(lambda: rig.get("input_int_register_0") == 19)
        rig.robot.faults.freeze = False
        await until(lambda: rig.cell.image.available[REAL] and rig.link.settled)
        rig.write((REAL, 3.5))
        await until(lambda: rig.get("input_double_register_0") == 3.5)


async def test_a_fallback_is_due_until_it_reads_back(rigged: Rigged, until: Until) -> None:
    """The connection is cut in the moment of the release: the next session gives it."""
    async with rigged() as rig:
        await until(lambda: rig.cell.accepts_writes)
        rig.cell.writer_connected(Requester(PLC), time.monotonic())
        rig.write((NUMBER, 7))
        await until(lambda: rig.get("input_int_register_0") == 7)
        sessions = rig.cell.health.sessions
        rig.robot.drop_clients()
        rig.cell.writer_disconnected(Requester(PLC), time.monotonic(), "gone")
        assert rig.cell.delivery.under_way
        await until(lambda: rig.cell.health.sessions > sessions and rig.cell.accepts_writes)
        await until(lambda: rig.get("input_int_register_0") == 0)
        await until(lambda: not rig.cell.delivery.under_way)
        assert not rig.cell.delivery.owed


UNREADABLE = ("input_bit_registers0_to_31", "input_int_register_0")
SHARED = """\
  first:  {robot: input_bit_register_1, modbus: 0.1}
  second: {robot: input_bit_register_2, modbus: 0.2, on_release: true}
  third:  {robot: input_bit_register_3, modbus: 0.3, on_release: hold}
  number: {robot: input_int_register_0, modbus: 1}
  other:  {robot: input_int_register_1, modbus: 3}
"""


async def test_what_cannot_be_read_is_named_and_not_sent_before_it_is_written(until: Until) -> None:
    def prepare(robot: SimulatedController) -> None:
        robot.faults.unreadable = frozenset(UNREADABLE)
        robot.set("input_bit_registers0_to_31", 0b1010)
        robot.set("input_int_register_0", 77)
        robot.set("input_int_register_1", 88)

    async with joined(SHARED, prepare=prepare) as rig:
        await until(lambda: rig.cell.accepts_writes)
        assert rig.events(EventKind.INPUTS_ADOPTED) == [
            "1 variable; not readable: first, second, third, number"
        ]
        assert rig.cell.health.unadopted == 4
        assert rig.cell.image.quality == [Quality.NEVER] * 4 + [Quality.GOOD]
        rig.write((4, 89))
        await until(lambda: rig.get("input_int_register_1") == 89)
        assert (rig.get(UNREADABLE[0]), rig.get(UNREADABLE[1])) == (0b1010, 77)
        rig.write((0, True))
        await until(lambda: rig.get(UNREADABLE[0]) == 0b0110)
        assert rig.get(UNREADABLE[1]) == 77
        fallbacks = [event for event in rig.cell.events if event.kind is EventKind.FALLBACK]
        assert [(one.variable, one.new) for one in fallbacks] == [(1, True), (2, False)]
        assert rig.cell.health.unadopted == 1
        rig.write((3, 5))
        await until(lambda: rig.get(UNREADABLE[1]) == 5)
        assert rig.cell.image.quality == [Quality.GOOD] * 5
        await until(
            lambda: rig.link._client.session is not None and len(rig.link._client.session.inputs) == 1
        )
        await until(lambda: rig.link.settled)
        rig.write((0, False), (3, 6), (4, 90))
        await until(lambda: rig.get("input_int_register_1") == 90)
        assert (rig.get(UNREADABLE[0]), rig.get(UNREADABLE[1])) == (0b0100, 6)


async def test_without_verification_nothing_is_read_back_on_the_wire(rigged: Rigged, until: Until) -> None:
    async with rigged(
        options=", verify: false", prepare=lambda robot: robot.set("input_int_register_0", 5)
    ) as rig:
        await until(lambda: rig.cell.accepts_writes)
        assert rig.cell.image.values[NUMBER] == 5, "read once, before the working recipe"
        session = rig.link._client.session
        assert session is not None
        assert not [name for name in session.outputs.names if name.startswith("input_")]


# -- what the robot holds --------------------------------------------------------------------------------------------


async def test_what_was_given_and_is_not_held_differs_and_is_sent_again(
    rigged: Rigged, until: Until, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The PLC wrote 7, the robot holds 99: not good, until it holds 7."""
    monkeypatch.setattr(readback_module, "VERIFY_AFTER", 0.1)
    async with rigged() as rig:
        await until(lambda: rig.cell.accepts_writes)
        rig.write((NUMBER, 7))
        await until(lambda: rig.get("input_int_register_0") == 7)
        await until(lambda: rig.link._inputs._recipes[0].is_settled)
        rig.robot.set("input_int_register_0", 99)
        await until(lambda: rig.cell.image.quality[NUMBER] is Quality.DIFFERS)
        assert rig.cell.health.differing == 1
        assert rig.cell.image.values[NUMBER] == 7
        assert rig.events(EventKind.READ_BACK_DIFFERS) == [
            "input_int_register_0: sent 7, the controller holds 99"
        ]
        await until(lambda: rig.get("input_int_register_0") == 7)
        await until(lambda: rig.cell.image.quality[NUMBER] is Quality.GOOD)
        assert (rig.cell.health.differing, rig.cell.health.read_back_mismatches) == (0, 1)


async def test_what_was_only_adopted_follows_the_robot(rigged: Rigged, until: Until) -> None:
    async with rigged() as rig:
        await until(lambda: rig.cell.accepts_writes)
        rig.robot.set("input_int_register_0", 99)
        rig.robot.set("input_bit_registers0_to_31", 0x80)
        await until(lambda: rig.cell.image.values[NUMBER] == 99)
        assert rig.cell.image.quality[NUMBER] is Quality.GOOD
        assert rig.events(EventKind.FOLLOWED) == [""]
        rig.write((BIT, True))
        await until(lambda: rig.get("input_bit_registers0_to_31") == 0x88)
        assert rig.get("input_int_register_0") == 99
        assert rig.cell.health.read_back_mismatches == 0
