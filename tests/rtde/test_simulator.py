"""The client against the project's simulated controller, with its faults."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING

import pytest

from gatewayd.rtde.fields import Series
from gatewayd.rtde.loss import LossReason
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.faults import Faults
from gatewayd.simulator.server import SimulatedController
from tests.rtde.conftest import send

if TYPE_CHECKING:
    from tests.rtde.conftest import Connected

Until = Callable[..., Awaitable[None]]


def image(side: str) -> tuple[str, ...]:
    """Everything that the guides reserve for fieldbus and PLC use."""
    words = tuple(f"{side}_bit_registers{bits}" for bits in ("0_to_31", "32_to_63"))
    return words + tuple(f"{side}_{kind}_register_{n}" for kind in ("int", "double") for n in range(24))


@pytest.mark.parametrize("series", Series)
@pytest.mark.parametrize(
    "faults",
    [
        Faults(),
        Faults(v1_only=True),
        Faults(text_on_connect="SafetySetup has not been confirmed yet"),
        Faults(drop=0.2, duplicate=0.2, split=0.2, seed=1),
    ],
    ids=["fine", "version 1", "text", "mangled"],
)
async def test_the_full_image_is_written_and_read_back(
    series: Series, faults: Faults, connected: Connected, until: Until
) -> None:
    async with SimulatedController(Controller(series, faults=faults)) as simulated:
        port = simulated.port
        async with connected(port=port, outputs=image("output"), inputs=image("input")) as (client, seen):
            await until(lambda: seen.packages)
            session = seen.sessions[0]
            assert session.unavailable == ()
            assert session.series is series
            values = [1 << 31, 7, *range(-12, 12), *(number / 4 for number in range(24))]
            assert send(client, "registers", values)
            slots = [session.outputs.slots[name] for name in image("input")]
            read_back = slice(slots[0].start, slots[-1].stop)
            await until(lambda: seen.packages[-1][read_back] == tuple(values))
            if faults.drop:
                await until(lambda: client.statistics.skipped > 0)
            assert not seen.losses


async def test_an_adapter_costs_the_fieldbus_range_and_nothing_else(
    connected: Connected, until: Until
) -> None:
    faults = Faults(adapter="profinet")
    async with SimulatedController(Controller(faults=faults)) as simulated:
        inputs = (*image("input"), "input_int_register_24", "input_bit_register_64")
        async with connected(port=simulated.port, inputs=inputs) as (_, seen):
            await until(lambda: seen.packages)
            session = seen.sessions[0]
            assert session.inputs["registers"].recipe.names == inputs[-2:]
            assert {one.word for one in session.unavailable} == {"IN_USE"}
            assert all("PROFINET" in one.hint for one in session.unavailable)


async def test_claims_that_outlive_their_connection_are_waited_for(
    connected: Connected, until: Until
) -> None:
    """A quick reconnect finds its own former claims in use."""
    async with (
        SimulatedController(Controller(faults=Faults(linger=0.3))) as simulated,
        connected(port=simulated.port, inputs=image("input")) as (client, seen),
    ):
        await until(lambda: seen.packages)
        simulated.drop_clients()
        await until(lambda: len(seen.sessions) == 2)
        assert len(seen.sessions[1].unavailable) == 50
        await until(lambda: seen.changes)
        assert client.session is not None
        assert client.session.unavailable == ()
        assert len(seen.losses) == 1


async def test_the_boot_restart_is_waited_out(connected: Connected, until: Until) -> None:
    async with (
        SimulatedController(Controller(faults=Faults(boot_restart=0.3))) as simulated,
        connected(port=simulated.port, inputs=image("input")) as (_, seen),
    ):
        await until(lambda: len(seen.sessions) == 2 and seen.packages)
        assert seen.losses[0].reason in {LossReason.CLOSED, LossReason.RESTARTED}


async def test_what_one_client_leaves_another_gets(connected: Connected, until: Until) -> None:
    async with SimulatedController() as simulated, AsyncExitStack() as leaving:
        both = {"port": simulated.port, "claim_retry": 0.05}
        _, first = await leaving.enter_async_context(connected(inputs=image("input")[:30], **both))
        await until(lambda: first.packages)
        async with connected(inputs=image("input"), **both) as (_, second):
            await until(lambda: second.packages)
            assert second.sessions[0].inputs["registers"].recipe.names == image("input")[30:]
            await leaving.aclose()
            await until(lambda: second.changes)
            assert second.changes[-1].inputs["registers"].recipe.names == image("input")
            assert not second.losses
