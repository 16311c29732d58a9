from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING

import pytest

from gatewayd.rtde import messages
from gatewayd.rtde.fields import Series
from gatewayd.rtde.loss import LossReason
from tests.rtde.conftest import send

if TYPE_CHECKING:
    from tests.rtde.conftest import Connected, Controller

Until = Callable[..., Awaitable[None]]
REGISTERS = tuple(f"input_int_register_{number}" for number in range(24))
DOUBLES = tuple(f"input_double_register_{number}" for number in range(24))


async def test_a_session_brings_values_in_the_order_asked_for(connected: Connected, until: Until) -> None:
    async with connected(outputs=("output_int_register_0", "actual_q"), frequency=100.0) as (_, seen):
        await until(lambda: len(seen.packages) > 3)
        (session,) = seen.sessions
        assert session.outputs.names == ("timestamp", "output_int_register_0", "actual_q")
        assert (session.series, session.protocol, session.period) == (Series.E, 2, 0.01)
        first, second = seen.packages[:2]
        assert len(first) == 8
        assert second[0] - first[0] == pytest.approx(0.01)
        assert second[1] - first[1] == 1


async def test_a_version_1_controller_is_spoken_to_in_version_1(
    controller: Controller, connected: Connected, until: Until
) -> None:
    """With texts in its layout between everything, and data packages without recipe id."""
    controller.script.protocols = frozenset({1})
    controller.script.version = messages.ControllerVersion(3, 4, 0, 1)
    controller.script.texts = True
    async with connected(outputs=("output_int_register_0",), inputs=REGISTERS) as (client, seen):
        await until(lambda: len(seen.packages) > 2)
        assert seen.sessions[0].protocol == 1
        assert {text.source for text in seen.texts} == {""}
        assert send(client, "registers", range(24))
        await until(lambda: controller.peer.written.get("input_int_register_23") == 23)
        assert not seen.losses


async def test_texts_are_tolerated_anywhere(
    controller: Controller, connected: Connected, until: Until
) -> None:
    """Before the version is agreed in its old layout, then between all answers."""
    controller.script.texts = True
    async with connected(inputs=REGISTERS) as (_, seen):
        await until(lambda: len(seen.packages) > 2)
        assert [text.source for text in seen.texts[:2]] == ["", "URControl"]
        assert not seen.losses


async def test_missing_outputs_cost_only_themselves(
    controller: Controller, connected: Connected, until: Until
) -> None:
    controller.script.missing = {"output_int_register_1", "no_such_field"}
    wanted = ("output_int_register_0", "output_int_register_1", "no_such_field", "output_int_register_2")
    async with connected(outputs=wanted) as (_, seen):
        await until(lambda: seen.packages)
        assert seen.sessions[0].outputs.names == ("timestamp", wanted[0], wanted[3])
        assert [one.field for one in seen.sessions[0].unavailable] == [wanted[1], wanted[2]]


async def test_inputs_in_use_are_claimed_as_they_are_freed_on_the_same_connection(
    controller: Controller, connected: Connected, until: Until
) -> None:
    controller.script.in_use = {REGISTERS[3], REGISTERS[7]}
    async with connected(inputs=REGISTERS, claim_retry=0.02) as (client, seen):
        await until(lambda: seen.packages)
        session = seen.sessions[0]
        assert {one.field for one in session.unavailable} == {REGISTERS[3], REGISTERS[7]}
        assert send(client, "registers", [5] * 22)
        await until(lambda: len(controller.peer.written) == 22)
        controller.script.in_use = {REGISTERS[7]}
        await until(lambda: len(seen.changes) == 1)
        assert seen.changes[0].inputs["registers"].recipe.names == tuple(
            name for name in REGISTERS if name != REGISTERS[7]
        )
        controller.script.in_use = set()
        await until(lambda: len(seen.changes) == 2)
        assert client.session is seen.changes[1]
        assert client.session.unavailable == ()
        assert send(client, "registers", range(24))
        await until(lambda: controller.peer.written.get(REGISTERS[7]) == 7)
        assert (len(controller.peers), len(seen.sessions)) == (1, 1)


async def test_values_written_together_go_out_in_one_package(
    controller: Controller, connected: Connected, until: Until
) -> None:
    inputs = (*REGISTERS, *DOUBLES, "speed_slider_mask", "speed_slider_fraction")
    async with connected(inputs=inputs, watchdog="input_int_register_24") as (client, seen):
        await until(lambda: seen.packages)
        assert set(seen.sessions[0].inputs) == {"registers", "speed_slider", "watchdog"}
        assert send(client, "registers", [*range(24), *(number / 2 for number in range(24))])
        assert send(client, "speed_slider", (1, 0.5))
        assert send(client, "watchdog", (1,))
        await until(lambda: "input_int_register_24" in controller.peer.written)
        packages = [one for one in controller.peer.received if isinstance(one, messages.DataPackage)]
        assert [one.recipe for one in packages] == [1, 2, 3]
        assert controller.peer.written[DOUBLES[23]] == 11.5
        assert client.statistics.writes == 3


async def test_what_is_written_is_read_back_in_the_packages(connected: Connected, until: Until) -> None:
    async with connected(inputs=REGISTERS) as (client, seen):
        await until(lambda: seen.packages)
        slot = seen.sessions[0].outputs.slots[REGISTERS[5]]
        send(client, "registers", range(100, 124))
        await until(lambda: seen.packages[-1][slot] == (105,))


async def test_what_cannot_be_sent_is_not(connected: Connected, until: Until) -> None:
    async with connected(inputs=REGISTERS[:1], backoff=0.2) as (client, seen):
        assert not send(client, "registers", (1,))
        await until(lambda: seen.packages)
        assert not send(client, "speed_slider", (1, 1.0))
        with pytest.raises(ValueError, match="input_int_register_0 is INT32"):
            send(client, "registers", (1 << 31,))


async def test_a_restarted_controller_gets_the_full_set_up_again(
    controller: Controller, connected: Connected, until: Until
) -> None:
    async with connected(inputs=REGISTERS, outputs=("robot_mode",)) as (client, seen):
        await until(lambda: seen.packages)
        await controller.shut()
        await until(lambda: any(loss.reason is LossReason.REFUSED for loss in seen.losses))
        assert client.session is None
        assert (seen.losses[0].reason, seen.losses[0].started) == (LossReason.CLOSED, True)
        await controller.listen()
        await until(lambda: len(seen.sessions) == 2)
        first, second = (
            [one for one in peer.received if not isinstance(one, messages.DataPackage)]
            for peer in controller.peers
        )
        assert first == second
        assert client.statistics.sessions == 2


async def test_attempts_back_off_up_to_the_limit(
    controller: Controller, connected: Connected, until: Until
) -> None:
    await controller.shut()
    async with connected(backoff=0.01, backoff_limit=0.05) as (_, seen):
        await until(lambda: len(seen.losses) >= 5)
        assert [loss.retry_in for loss in seen.losses[:5]] == [0.01, 0.02, 0.04, 0.05, 0.05]
        assert [loss.attempts for loss in seen.losses[:5]] == [1, 2, 3, 4, 5]
        assert "RTDE service is off" in seen.losses[0].text


@pytest.mark.parametrize("host", ["a..b", "no host"])
async def test_a_host_that_cannot_be_is_told(host: str, connected: Connected, until: Until) -> None:
    async with connected(host=host) as (_, seen):
        await until(lambda: seen.losses)
        assert seen.losses[0].reason is LossReason.UNRESOLVED


async def test_all_addresses_of_a_name_are_tried(connected: Connected, until: Until) -> None:
    """`localhost` may be ::1 first, where nobody listens."""
    async with connected(host="localhost") as (_, seen):
        await until(lambda: seen.packages)


async def test_pause_and_resume(controller: Controller, connected: Connected, until: Until) -> None:
    async with connected(data_timeout=0.1) as (client, seen):
        await until(lambda: seen.packages)
        await client.pause()
        assert isinstance(controller.peer.received[-1], messages.Pause)
        count = len(seen.packages)
        await asyncio.sleep(0.2)
        assert len(seen.packages) == count
        await client.resume()
        await until(lambda: len(seen.packages) > count)
        assert not seen.losses


async def test_a_paused_client_stays_paused_over_a_new_connection(
    controller: Controller, connected: Connected, until: Until
) -> None:
    async with connected() as (client, seen):
        await until(lambda: seen.packages)
        await client.pause()
        await controller.shut()
        await controller.listen()
        await until(lambda: len(seen.sessions) == 2)
        assert not any(isinstance(one, messages.Start) for one in controller.peer.received)
        await client.resume()
        await until(lambda: any(isinstance(one, messages.Start) for one in controller.peer.received))


async def test_without_a_session_pause_and_resume_return_at_once(
    controller: Controller, connected: Connected
) -> None:
    await controller.shut()
    async with connected() as (client, _):
        await client.pause()
        await client.resume()


OUTPUTS = tuple(f"output_{kind}_register_{number}" for kind in ("int", "double") for number in range(24))
BITS = tuple(f"input_bit_register_{number}" for number in range(64, 128))


async def test_a_controller_that_stays_silent_to_a_long_list_is_read_in_pieces(
    controller: Controller, connected: Connected, until: Until
) -> None:
    """Silence is no statement: the list is tried twice. What every register holds is known before it can be sent."""
    controller.script.name_limit = 2048
    async with connected(outputs=OUTPUTS, inputs=REGISTERS + DOUBLES, handshake_timeout=0.1) as (_, seen):
        await until(lambda: seen.packages)
        assert [loss.reason for loss in seen.losses] == [LossReason.UNANSWERED] * 2
        session = seen.sessions[0]
        assert session.outputs.names[: 1 + len(OUTPUTS)] == ("timestamp", *OUTPUTS)
        read_back = set(session.outputs.names) & set(REGISTERS + DOUBLES)
        assert session.held.keys() == set(REGISTERS + DOUBLES) - read_back
        assert session.unread == frozenset()


async def test_a_complaint_instead_of_an_answer_is_a_statement(
    controller: Controller, connected: Connected, until: Until
) -> None:
    controller.script.name_limit = 2048
    controller.script.complains = True
    settings = {"outputs": OUTPUTS, "inputs": REGISTERS + DOUBLES, "handshake_timeout": 0.1}
    async with connected(**settings) as (client, seen):
        await until(lambda: seen.packages)
        assert len(seen.losses) == 1
        client.reconnect("once more")
        await until(lambda: len(seen.sessions) == 2)
        assert [loss.reason for loss in seen.losses] == [LossReason.UNANSWERED, LossReason.RECONNECT]


async def test_more_inputs_than_an_old_controller_takes_at_once_are_claimed_by_parts(
    controller: Controller, connected: Connected, until: Until
) -> None:
    controller.script.name_limit = 2048
    inputs = (*REGISTERS, *DOUBLES, *BITS)
    async with connected(inputs=inputs, handshake_timeout=0.1, read_back=False) as (client, seen):
        await until(lambda: seen.packages)
        claimed = seen.sessions[0].inputs
        assert list(claimed) == ["registers", "registers 2"]
        assert claimed["registers"].recipe.names + claimed["registers 2"].recipe.names == inputs
        assert seen.sessions[0].held.keys() == set(inputs)
        assert send(client, "registers 2", [True] * claimed["registers 2"].recipe.count)
        await until(lambda: controller.peer.written.get(BITS[63]) is True)


async def test_recipes_of_a_former_connection_are_refused(
    controller: Controller, connected: Connected, until: Until
) -> None:
    """Those of a former session object of the same connection are not."""
    controller.script.in_use = {REGISTERS[1]}
    async with connected(inputs=REGISTERS[:2], claim_retry=0.02) as (client, seen):
        await until(lambda: seen.packages)
        first = seen.sessions[0].inputs["registers"]
        controller.script.in_use = set()
        await until(lambda: seen.changes)
        assert client.send(first, (5,))
        await until(lambda: controller.peer.written.get(REGISTERS[0]) == 5)
        client.reconnect("a test")
        assert not client.send(first, (6,))
        await until(lambda: len(seen.sessions) == 2)
        assert not client.send(first, (6,))
        assert not client.send(seen.changes[0].inputs["registers"], (6, 6))
        assert client.send(seen.sessions[1].inputs["registers"], (7, 8))
        await until(lambda: controller.peer.written.get(REGISTERS[1]) == 8)


async def test_a_register_that_cannot_be_read_joins_the_others_once_it_is_sent(
    controller: Controller, connected: Connected, until: Until
) -> None:
    controller.script.missing = {REGISTERS[1]}
    controller.script.claimable = {REGISTERS[1]}
    async with connected(inputs=REGISTERS[:3]) as (client, seen):
        await until(lambda: seen.packages)
        assert seen.sessions[0].unread == {REGISTERS[1]}
        assert set(seen.sessions[0].inputs) == {"registers", REGISTERS[1]}
        assert send(client, REGISTERS[1], (1,))
        client.join(REGISTERS[1])
        await until(lambda: seen.changes)
        assert seen.changes[0].inputs["registers"].recipe.names == REGISTERS[:3]
        assert client.send(seen.sessions[0].inputs["registers"], (1, 3))


async def test_a_reconnect_is_reported_once_and_what_was_sent_arrives(
    controller: Controller, connected: Connected, until: Until
) -> None:
    async with connected(inputs=REGISTERS) as (client, seen):
        client.reconnect("nothing to end yet")
        await until(lambda: seen.packages)
        send(client, "registers", range(24))
        client.reconnect("the clock stays behind")
        client.reconnect("again")
        await until(lambda: len(seen.sessions) == 2)
        assert [loss.reason for loss in seen.losses] == [LossReason.RECONNECT]
        assert seen.losses[0].text.endswith("the clock stays behind")
        assert seen.losses[0].started
        assert controller.peers[0].written[REGISTERS[23]] == 23


async def test_statistics_tell_the_measured_frequency(connected: Connected, until: Until) -> None:
    async with connected(frequency=50.0) as (client, seen):
        await until(lambda: client.statistics.frequency > 0)
        assert 20 < client.statistics.frequency < 55
        assert client.statistics.packages >= len(seen.packages)
