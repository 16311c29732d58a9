"""A set-up that goes wrong at any step, then one write: no other register changes.

Real sockets, the simulated controller with its faults, and a bare client that writes one register as soon as it may.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING

import pytest

from gatewayd.rtde.client import RtdeClient
from gatewayd.rtde.fields import INPUTS
from gatewayd.rtde.loss import LossReason
from gatewayd.rtde.recipe import Scalar
from gatewayd.rtde.types import DataType
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.faults import DropAt, Faults, FaultStep, LongLists
from gatewayd.simulator.server import SimulatedController

if TYPE_CHECKING:
    from tests.rtde.conftest import Connected, Notebook

Until = Callable[..., Awaitable[None]]

WORDS = tuple(f"input_bit_registers{bits}" for bits in ("0_to_31", "32_to_63"))
INPUT_REGISTERS = (*WORDS, *(f"input_{kind}_register_{n}" for kind in ("int", "double") for n in range(24)))
OUTPUT_REGISTERS = tuple(name.replace("input", "output") for name in INPUT_REGISTERS)
TARGET, FREED = "input_double_register_23", "input_double_register_22"
STEPS = [
    DropAt(FaultStep.VERSION),
    DropAt(FaultStep.CONTROLLER),
    *(DropAt(FaultStep.OUTPUTS, number) for number in (1, 2, 3)),
    *(DropAt(FaultStep.INPUTS, number) for number in (1, 2)),
    *(DropAt(FaultStep.START, number) for number in (1, 2)),
    DropAt(FaultStep.PAUSE),
    *(DropAt(FaultStep.DATA, number) for number in (1, 2)),
]


def preset(simulated: SimulatedController) -> None:
    """Give every register a value of its own."""
    for number, name in enumerate(INPUT_REGISTERS, 1001):
        simulated.set(name, number / 4 if INPUTS[name].type is DataType.DOUBLE else number)


def write(client: RtdeClient, seen: Notebook, name: str, value: Scalar) -> None:
    """Write one register as a user of the client does it: everything else in its package is what was read of it."""
    session = client.session
    assert session is not None
    recipe = next(one for one in session.inputs.values() if name in one.recipe.names)
    slots, newest = session.outputs.slots, seen.packages[-1]
    flat: list[Scalar] = []
    for field in recipe.recipe.names:
        if field == name:
            flat.append(value)
        else:
            assert field not in session.unread
            flat += newest[slots[field]] if field in slots else session.held[field]
    assert client.send(recipe, flat)


async def changes_one_register(
    simulated: SimulatedController, client: RtdeClient, seen: Notebook, until: Until, name: str = TARGET
) -> None:
    """Write until it has arrived, as connections may be lost meanwhile; everything else holds what it held before."""
    controller = simulated.controller
    before = {name: controller.get(name) for name in INPUT_REGISTERS}

    def written() -> bool:
        if client.session is not None and seen.calls[-1] == "values":
            write(client, seen, name, 0.125)
        return controller.get(name) == (0.125,)

    await until(written, 15.0)
    assert {name: controller.get(name) for name in INPUT_REGISTERS} == {**before, name: (0.125,)}


@pytest.mark.parametrize("verify", [True, False], ids=["verify", "no verify"])
@pytest.mark.parametrize("lists", LongLists, ids=lambda lists: lists.value)
@pytest.mark.parametrize("drop_at", STEPS, ids=lambda drop: f"{drop.step.value}:{drop.number}")
async def test_a_connection_lost_at_any_step_costs_no_register(
    drop_at: DropAt, lists: LongLists, verify: bool, connected: Connected, until: Until
) -> None:
    faults = Faults(long_lists=lists, drop_at=drop_at)
    async with SimulatedController(Controller(faults=faults)) as simulated:
        preset(simulated)
        settings = {
            "outputs": OUTPUT_REGISTERS,
            "inputs": INPUT_REGISTERS,
            "read_back": verify,
            "handshake_timeout": 0.25,
            "backoff_limit": 0.05,
        }
        async with connected(port=simulated.port, **settings) as (client, seen):
            if drop_at.step is FaultStep.DATA:
                await until(lambda: not faults.drop_times and seen.losses, 15.0)
            await until(lambda: seen.packages, 15.0)
            assert seen.sessions[-1].unread == frozenset()
            await changes_one_register(simulated, client, seen, until)


@pytest.mark.parametrize("answer", ["dropped twice", "always dropped", "late"])
async def test_a_long_list_that_comes_to_nothing_is_no_reason_to_leave_inputs_unread(
    answer: str, connected: Connected, until: Until
) -> None:
    times = {"dropped twice": 2.0, "always dropped": float("inf"), "late": 0.0}[answer]
    faults = Faults(drop_at=DropAt(FaultStep.OUTPUTS), drop_times=times)
    if answer == "always dropped":
        faults = Faults(long_lists=LongLists.CLOSE)
    async with SimulatedController(Controller(faults=faults)) as simulated:
        preset(simulated)
        settings = {"outputs": OUTPUT_REGISTERS, "inputs": INPUT_REGISTERS, "handshake_timeout": 0.25}
        simulated.faults.delay = 1.0 if answer == "late" else 0.0
        async with connected(port=simulated.port, **settings) as (client, seen):
            await until(lambda: seen.losses)
            simulated.faults.delay = 0.0
            await until(lambda: seen.packages)
            await changes_one_register(simulated, client, seen, until)


@pytest.mark.parametrize(
    "faults",
    [
        Faults(long_lists=LongLists.REFUSE, v1_only=True),
        Faults(long_lists=LongLists.COMPLAIN, v1_only=True),
        Faults(long_lists=LongLists.REFUSE, drop=0.2, duplicate=0.2, split=0.2, seed=1),
        Faults(long_lists=LongLists.REFUSE, text_on_connect="SafetySetup has not been confirmed yet"),
    ],
    ids=["version 1, refused", "version 1, complained of", "mangled", "text"],
)
async def test_readings_in_pieces_bear_other_faults(
    faults: Faults, connected: Connected, until: Until
) -> None:
    async with SimulatedController(Controller(faults=faults)) as simulated:
        preset(simulated)
        settings = {"outputs": OUTPUT_REGISTERS, "inputs": INPUT_REGISTERS, "handshake_timeout": 0.25}
        async with connected(port=simulated.port, **settings) as (client, seen):
            await until(lambda: seen.packages)
            assert seen.sessions[-1].held
            await changes_one_register(simulated, client, seen, until)


@pytest.mark.parametrize("lists", [LongLists.TAKE, LongLists.REFUSE], ids=lambda lists: lists.value)
@pytest.mark.parametrize("verify", [True, False], ids=["verify", "no verify"])
async def test_an_input_that_is_freed_while_the_clock_stands_still_is_read_before_it_is_ours(
    lists: LongLists, verify: bool, connected: Connected, until: Until
) -> None:
    faults = Faults(long_lists=lists, hold=(FREED,))
    async with SimulatedController(Controller(faults=faults)) as simulated:
        preset(simulated)
        settings = {
            "outputs": OUTPUT_REGISTERS,
            "inputs": INPUT_REGISTERS,
            "read_back": verify,
            "claim_retry": 0.02,
        }
        async with connected(port=simulated.port, **settings) as (client, seen):
            await until(lambda: seen.packages)
            former = seen.sessions[0].inputs["registers"]
            assert FREED not in former.recipe.names
            simulated.faults.freeze = True
            simulated.controller.free([FREED])
            await until(lambda: seen.changes)
            await until(lambda: seen.calls[-1] == "values")
            assert client.session is not None
            assert client.session.outputs is seen.sessions[0].outputs
            await changes_one_register(simulated, client, seen, until, FREED)
            assert not seen.losses


@pytest.mark.parametrize("verify", [True, False], ids=["verify", "no verify"])
async def test_registers_that_cannot_be_read_are_written_alone_then_with_the_others(
    verify: bool, connected: Connected, until: Until
) -> None:
    unreadable = (INPUT_REGISTERS[0], TARGET, FREED)
    async with SimulatedController(Controller(faults=Faults(unreadable=frozenset(unreadable)))) as simulated:
        preset(simulated)
        settings = {"outputs": OUTPUT_REGISTERS, "inputs": INPUT_REGISTERS, "read_back": verify}
        async with connected(port=simulated.port, **settings) as (client, seen):
            await until(lambda: seen.packages)
            session = seen.sessions[0]
            assert session.unread == set(unreadable)
            assert {key for key in session.inputs if key in unreadable} == set(unreadable)
            await changes_one_register(simulated, client, seen, until)
            client.join(TARGET)
            await until(lambda: seen.changes)
            joined = seen.changes[-1]
            assert TARGET in joined.inputs["registers"].recipe.names
            assert set(joined.inputs) == {"registers", INPUT_REGISTERS[0], FREED}
            assert client.session is joined
            assert not seen.losses


async def test_a_controller_that_pauses_answers_a_probe_when_it_goes_on(
    connected: Connected, until: Until
) -> None:
    async with SimulatedController() as simulated, connected(port=simulated.port) as (client, seen):
        await until(lambda: seen.packages)
        simulated.pause(0.3)
        assert client.probe()
        await until(lambda: seen.delays)
        assert 0.2 < seen.delays[0] < 2
        assert not seen.losses


async def test_behind_a_backlog_the_answer_to_a_probe_is_as_late_as_the_packages(
    connected: Connected, until: Until
) -> None:
    async with SimulatedController() as simulated, connected(port=simulated.port) as (client, seen):
        await until(lambda: seen.packages)
        simulated.faults.delay = 0.3
        assert client.probe()
        await until(lambda: seen.delays)
        assert 0.25 < seen.delays[0] < 2
        assert client.session is not None
        client.reconnect("the packages are 0.3 s old")
        await until(lambda: len(seen.sessions) == 2)
        assert seen.losses[-1].reason is LossReason.RECONNECT
