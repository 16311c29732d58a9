from __future__ import annotations

import asyncio
import math
import socket
from collections.abc import Awaitable, Callable, Iterable
from typing import TYPE_CHECKING, Any

import pytest

from gatewayd.rtde import messages
from gatewayd.rtde.client import RtdeClient
from gatewayd.rtde.loss import LossReason
from gatewayd.rtde.session import ClientSettings
from gatewayd.rtde.strange import Oddity
from tests.rtde.conftest import E_SERIES, Notebook, send

if TYPE_CHECKING:
    from gatewayd.rtde.recipe import Scalar
    from tests.rtde.conftest import Connected, Controller

Until = Callable[..., Awaitable[None]]
DOUBLES = tuple(f"input_double_register_{number}" for number in range(24))


async def test_small_writes_are_not_delayed_and_dead_peers_are_noticed(
    connected: Connected, until: Until
) -> None:
    async with connected() as (client, seen):
        await until(lambda: seen.packages)
        assert client._connection is not None
        assert client._connection.sender._transport is not None
        own: Any = client._connection.sender._transport.get_extra_info("socket")
        assert own.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
        assert own.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)


def burst(controller: Controller, seen: Notebook, timestamps: Iterable[float]) -> None:
    """Packages in one segment."""
    peer, layout = controller.peer, seen.sessions[0].outputs
    packages = (messages.DataPackage(1, layout.pack((one,))) for one in timestamps)
    peer.writer.write(b"".join(map(peer.protocol.send, packages)))


async def test_packages_that_wait_together_are_handed_on_in_their_order(
    controller: Controller, connected: Connected, until: Until
) -> None:
    controller.script.sends_data = False
    async with connected() as (client, seen):
        await until(lambda: seen.sessions)
        burst(controller, seen, [1.0, 2.0, 3.0, 4.0, 5.0])
        await until(lambda: seen.packages)
        assert seen.earlier_packages == [(1.0,), (2.0,), (3.0,), (4.0,)]
        assert seen.packages == [(5.0,)]
        assert (client.statistics.packages, client.statistics.overtaken) == (5, 0)


async def test_earlier_packages_that_are_not_taken_are_counted(
    controller: Controller, connected: Connected, until: Until
) -> None:
    controller.script.sends_data = False
    async with connected() as (client, seen):
        seen.takes_earlier = False
        await until(lambda: seen.sessions)
        burst(controller, seen, [1.0, 2.0, 3.0])
        await until(lambda: seen.packages)
        assert (client.statistics.packages, client.statistics.overtaken) == (3, 2)


async def test_of_a_great_burst_only_the_end_is_handed_on(
    controller: Controller, connected: Connected, until: Until
) -> None:
    controller.script.sends_data = False
    async with connected() as (client, seen):
        await until(lambda: seen.sessions)
        burst(controller, seen, [0.002 * step for step in range(1000)])
        await until(lambda: client.statistics.packages == 1000)
        assert seen.packages == [(0.002 * 999,)]
        assert seen.earlier_packages == [(0.002 * step,) for step in range(935, 999)]
        assert client.statistics.overtaken == 935
        assert client.statistics.skipped == 0


async def test_a_clock_that_goes_back_within_a_burst_is_a_restart(
    controller: Controller, connected: Connected, until: Until
) -> None:
    controller.script.sends_data = False
    async with connected() as (_, seen):
        await until(lambda: seen.sessions)
        burst(controller, seen, [50.0, 50.008, 1.0, 1.008])
        await until(lambda: seen.losses)
        assert seen.losses[0].reason is LossReason.RESTARTED
        assert (seen.earlier_packages, seen.packages) == ([(50.0,), (50.008,)], [])


async def test_skipped_packages_are_counted(
    controller: Controller, connected: Connected, until: Until
) -> None:
    controller.script.sends_data = False
    async with connected() as (client, seen):
        await until(lambda: seen.sessions)
        controller.peer.package()
        controller.peer.package(4)
        await until(lambda: client.statistics.packages == 2)
        assert client.statistics.skipped == 3


async def test_data_that_comes_before_the_answer_to_the_start_counts(
    controller: Controller, connected: Connected, until: Until
) -> None:
    controller.script.data_before_start_reply = True
    async with connected() as (_, seen):
        await until(lambda: len(seen.packages) > 2)
        assert len(seen.sessions) == 1
        assert not seen.losses


@pytest.mark.parametrize(
    "request_type, words",
    [
        (messages.RequestProtocolVersion, "the answer to protocol version 2"),
        (messages.GetControllerVersion, "the controller version"),
        (messages.SetupOutputs, "the answer to the output recipe"),
        (messages.SetupInputs, "the answer to an input recipe"),
    ],
)
async def test_a_request_that_is_not_answered_ends_the_connection(
    request_type: type, words: str, controller: Controller, connected: Connected, until: Until
) -> None:
    controller.script.mute = {request_type}
    async with connected(inputs=("input_int_register_0",), handshake_timeout=0.05) as (_, seen):
        await until(lambda: seen.losses)
        assert seen.losses[0].reason is LossReason.UNANSWERED
        assert f"{words} did not arrive within 0.05 s" in seen.losses[0].text
        controller.script.mute.clear()
        await until(lambda: seen.packages)


async def test_a_refused_start_is_told_and_tried_again(
    controller: Controller, connected: Connected, until: Until
) -> None:
    controller.script.accept_start = False
    async with connected() as (_, seen):
        await until(lambda: seen.losses)
        assert seen.losses[0].reason is LossReason.HANDSHAKE
        assert not seen.sessions
        controller.script.accept_start = True
        await until(lambda: seen.packages)


async def test_silence_ends_the_connection(
    controller: Controller, connected: Connected, until: Until
) -> None:
    async with connected(data_timeout=0.1) as (_, seen):
        await until(lambda: seen.packages)
        controller.peer.stop()
        await until(lambda: seen.losses)
        assert seen.losses[0].reason is LossReason.SILENT
        await until(lambda: len(seen.sessions) == 2)


async def test_slow_packages_are_no_silence(connected: Connected, until: Until) -> None:
    async with connected(frequency=10.0, data_timeout=0.02) as (_, seen):
        await until(lambda: len(seen.packages) > 3)
        assert not seen.losses


async def test_the_first_package_may_take_longer(
    controller: Controller, connected: Connected, until: Until
) -> None:
    """A controller whose safety set-up is not confirmed accepts the start and sends nothing."""
    controller.script.sends_data = False
    async with connected(data_timeout=0.05, first_data_timeout=1.0) as (_, seen):
        await until(lambda: seen.sessions)
        await asyncio.sleep(0.2)
        assert not seen.losses
        await until(lambda: seen.losses)
        assert seen.losses[0].reason is LossReason.SILENT
        assert "safety set-up confirmed" in seen.losses[0].text


async def test_the_boot_restart_of_a_controller_is_only_a_new_connection(
    controller: Controller, connected: Connected, until: Until
) -> None:
    async with connected() as (_, seen):
        await until(lambda: seen.packages)
        controller.script.time_zero = 0.0
        await until(lambda: len(seen.sessions) == 2)
        assert seen.losses[0].reason is LossReason.RESTARTED
        assert "its RTDE service has restarted" in seen.losses[0].text


async def test_bytes_that_cannot_be_cut_into_packages_end_the_connection(
    controller: Controller, connected: Connected, until: Until
) -> None:
    async with connected() as (_, seen):
        await until(lambda: seen.packages)
        controller.peer.stop()
        controller.peer.writer.write(bytes(4))
        await until(lambda: seen.losses)
        assert seen.losses[0].reason is LossReason.PROTOCOL
        assert "package size 0 is less" in seen.losses[0].text
        await until(lambda: len(seen.sessions) == 2)


ODD = {
    "unknown type": (b"\x00\x05\xff\x00\x00", Oddity.UNKNOWN_TYPE, "unknown package type 255"),
    "properties": (b"\x00\x05\x52\0\0", Oddity.UNEXPECTED, "properties that were not asked for"),
    "data too short": (
        b"\x00\x05\x55\x01\x00",
        Oddity.RECIPE,
        "data package with 1 byte of values, the recipe",
    ),
    "data too long": (
        b"\x00\x0d\x55\x01" + bytes(9),
        Oddity.RECIPE,
        "data package with 9 bytes of values, the recipe",
    ),
    "data of another recipe": (b"\x00\x0c\x55\x02" + bytes(8), Oddity.RECIPE, "recipe 2 where 1 was agreed"),
    "data without a recipe": (b"\x00\x03\x55", Oddity.LAYOUT, "DATA_PACKAGE with payload of no bytes"),
    "trailing byte": (b"\x00\x05\x53\x01\x00", Oddity.LAYOUT, "START with payload of 2 bytes, 1 expected"),
    "text of version 1": (b"\x00\x0a\x4d\x03legacy", Oddity.LAYOUT, "TEXT_MESSAGE with source length 97"),
    "pause": (b"\x00\x04\x50\x01", Oddity.UNEXPECTED, "PauseReply while data was awaited"),
    "inputs": (b"\x00\x08\x49\x01BOOL", Oddity.UNEXPECTED, "InputsSetup while data was awaited"),
    "outputs": (b"\x00\x08\x4f\x01BOOL", Oddity.UNEXPECTED, "OutputsSetup while data was awaited"),
    "version": (b"\x00\x04\x56\x01", Oddity.UNEXPECTED, "ProtocolVersionReply while data was awaited"),
    "refusal": (b"\x00\x04\x53\x00", Oddity.UNEXPECTED, "a refused start of the output that runs"),
}


@pytest.mark.parametrize("name", ODD)
async def test_an_odd_package_is_counted_reported_once_and_ends_no_session(
    name: str, controller: Controller, connected: Connected, until: Until
) -> None:
    odd, oddity, words = ODD[name]
    async with connected() as (client, seen):
        await until(lambda: seen.packages)
        for count in (1, 2, 3):
            controller.peer.writer.write(odd)
            await until(lambda: client.statistics.strange.by_oddity[oddity] == count)  # noqa: B023
        packages = len(seen.packages)
        await until(lambda: len(seen.packages) > packages + 10)
        (reported,) = seen.strange_packages
        assert reported.oddity is oddity
        assert words in reported.reason
        assert client.statistics.strange.total == 3
        assert (len(seen.sessions), seen.losses) == (1, [])
        assert all(len(values) == 1 and values[0] >= 100.0 for values in seen.packages)


async def test_a_text_in_the_layout_of_version_1_is_a_text_all_the_same(
    controller: Controller, connected: Connected, until: Until
) -> None:
    async with connected() as (_, seen):
        await until(lambda: seen.packages)
        controller.peer.writer.write(b"\x00\x0a\x4d\x02caf\xe9!!")
        await until(lambda: seen.texts)
        assert seen.texts == [messages.TextMessage("caf\\xe9!!", "", 2)]


async def test_odd_packages_amid_the_set_up_and_answers_with_more_behind_them_do_no_harm(
    controller: Controller, connected: Connected, until: Until
) -> None:
    def spoil(package: bytes) -> bytes:
        kind = package[2]
        odd = b"\x00\x04\x52\x00" + b"\x00\x04\x50\x01" + b"\x00\x05\x99\x00\x00"
        if kind in (messages.PackageType.DATA_PACKAGE, messages.PackageType.SETUP_INPUTS, 79):
            return odd + package
        return odd + (len(package) + 2).to_bytes(2) + package[2:] + b"\x00\x00"

    controller.script.spoil = spoil
    async with connected(inputs=("input_int_register_0",)) as (client, seen):
        await until(lambda: len(seen.packages) > 10)
        assert (len(seen.sessions), seen.losses) == (1, [])
        assert client.session is not None
        assert client.session.controller == E_SERIES
        assert {one.oddity for one in seen.strange_packages} == {
            Oddity.UNKNOWN_TYPE,
            Oddity.LAYOUT,
            Oddity.UNEXPECTED,
        }


async def test_a_flood_of_odd_packages_is_no_data_and_the_loss_says_what_came_instead(
    controller: Controller, connected: Connected, until: Until
) -> None:
    async with connected(data_timeout=0.1) as (_, seen):
        await until(lambda: seen.packages)
        controller.peer.stop()
        while not seen.losses:
            controller.peer.writer.write(b"\x00\x0c\x55\x07" + bytes(8))
            await asyncio.sleep(0.002)
        assert seen.losses[0].reason is LossReason.SILENT
        assert "data package of recipe 7 where 1 was agreed" in seen.losses[0].text
        assert len(seen.strange_packages) == 1


async def test_who_speaks_another_protocol_is_shown(
    controller: Controller, connected: Connected, until: Until
) -> None:
    controller.script.spoil = lambda _: b"SSH-2.0-OpenSSH_9.2\r\n"
    async with connected(handshake_timeout=0.1) as (_, seen):
        await until(lambda: seen.losses)
        assert seen.losses[0].reason is LossReason.UNANSWERED
        assert "21 of 21331 bytes of unknown type 72: 53 53 48 2d" in seen.losses[0].text


async def test_what_the_controller_does_not_send_while_we_pause_it_is_not_skipped(
    controller: Controller, connected: Connected, until: Until
) -> None:
    async with connected() as (client, seen):
        await until(lambda: seen.packages)
        await client.pause()
        controller.peer.step += 250
        await client.resume()
        packages = len(seen.packages)
        await until(lambda: len(seen.packages) > packages + 10)
        assert (client.statistics.skipped, client.statistics.pauses) == (0, 0)
        assert not seen.losses


async def test_a_controller_that_stands_still_pauses_once(
    controller: Controller, connected: Connected, until: Until
) -> None:
    async with connected() as (client, seen):
        await until(lambda: seen.packages)
        controller.peer.step += 250
        await until(lambda: client.statistics.pauses)
        assert (client.statistics.skipped, client.statistics.pauses) == (0, 1)
        assert not seen.losses


async def test_what_came_before_an_error_is_still_handed_on(
    controller: Controller, connected: Connected, until: Until
) -> None:
    controller.script.sends_data = False
    async with connected() as (_, seen):
        await until(lambda: seen.sessions)
        good = seen.sessions[0].outputs.pack((1.0,))
        controller.peer.writer.write(controller.peer.protocol.send(messages.DataPackage(1, good)) + bytes(3))
        await until(lambda: seen.losses)
        assert seen.packages == [(1.0,)]


async def test_a_controller_that_does_not_read_is_given_up_and_no_write_waits(
    controller: Controller, connected: Connected, until: Until
) -> None:
    async with connected(inputs=DOUBLES, data_timeout=5.0) as (client, seen):
        await until(lambda: seen.packages)
        controller.script.stop_reading = True
        sent = 0
        while send(client, "registers", [0.0] * 24):
            sent += 1
            assert sent < 200_000
        await until(lambda: seen.losses)
        assert seen.losses[0].reason is LossReason.CONGESTED


async def test_used_up_recipe_ids_cost_a_new_connection(
    controller: Controller, connected: Connected, until: Until
) -> None:
    controller.script.in_use = {DOUBLES[0]}
    async with connected(inputs=DOUBLES, claim_retry=0.02) as (client, seen):
        await until(lambda: seen.packages)
        assert client._connection is not None
        negotiation = client._connection._negotiation
        await until(lambda: not negotiation.waiting)  # a claim that is under way would still be taken
        negotiation.claims._used = 255
        controller.script.in_use = set()
        await until(lambda: len(seen.sessions) == 2)
        assert seen.losses[0].reason is LossReason.RECIPES
        assert seen.sessions[1].unavailable == ()


async def test_what_was_sent_before_the_end_arrives(
    controller: Controller, connected: Connected, until: Until
) -> None:
    async with connected(inputs=DOUBLES) as (client, seen):
        await until(lambda: seen.packages)
        send(client, "registers", [1.5] * 24)
    await until(lambda: controller.peer.written.get(DOUBLES[23]) == 1.5)


async def test_after_the_end_no_handler_is_called(
    controller: Controller, connected: Connected, until: Until
) -> None:
    async with connected() as (_, seen):
        await until(lambda: seen.packages)
    count = len(seen.packages)
    await asyncio.sleep(0.05)
    assert len(seen.packages) == count
    assert not seen.losses
    assert controller.peer.writer.is_closing()


@pytest.mark.parametrize("error", [LookupError("a bug"), OSError("a bug")], ids=["lookup", "os"])
async def test_an_exception_of_a_handler_ends_the_client(error: Exception, controller: Controller) -> None:
    class Failing:
        def session_started(self, session: object) -> None:
            raise error

        values = inputs_changed = session_lost = text = session_started

    handler: Any = Failing()
    with pytest.raises(type(error), match="a bug"):
        await RtdeClient(ClientSettings(host="127.0.0.1", port=controller.port), handler).run()


async def test_pausing_ends_with_the_connection(
    controller: Controller, connected: Connected, until: Until
) -> None:
    async with connected(handshake_timeout=0.05) as (client, seen):
        await until(lambda: seen.packages)
        controller.script.mute = {messages.Pause}
        await client.pause()
        await until(lambda: seen.losses)
        assert seen.losses[0].reason is LossReason.UNANSWERED


async def test_a_probe_tells_how_long_the_answer_took(connected: Connected, until: Until) -> None:
    async with connected() as (client, seen):
        assert not client.probe()
        await until(lambda: seen.packages)
        assert client.probe()
        assert not client.probe()
        await until(lambda: seen.delays)
        assert 0 < seen.delays[0] < 1
        assert client.probe()
        await until(lambda: len(seen.delays) == 2)
        assert not seen.losses


async def test_a_probe_without_an_answer_is_no_loss(
    controller: Controller, connected: Connected, until: Until
) -> None:
    async with connected(handshake_timeout=0.05) as (client, seen):
        await until(lambda: seen.packages)
        controller.script.mute = {messages.GetControllerVersion}
        assert client.probe()
        await until(lambda: seen.delays)
        assert seen.delays == [math.inf]
        controller.script.mute.clear()
        controller.peer.say(controller.script.version)
        assert client.probe()
        await until(lambda: len(seen.delays) == 2)
        assert seen.delays[1] < 1
        assert len(seen.sessions) == 1


async def test_a_package_from_before_a_claim_is_no_reading_of_it(
    controller: Controller, connected: Connected, until: Until
) -> None:
    """In one segment with the answer to the claim, the package before it is delivered before the change is reported."""
    controller.script.in_use = {"input_int_register_0"}
    controller.script.sends_data = False
    async with connected(inputs=("input_int_register_0",), claim_retry=0.02) as (_, seen):
        await until(lambda: seen.sessions)
        controller.script.package_before_inputs_reply = True
        controller.script.in_use = set()
        await until(lambda: seen.changes)
        assert seen.calls[-1] == "inputs_changed"
        assert "values" in seen.calls


async def test_the_round_trip_of_the_set_up_is_measured(connected: Connected, until: Until) -> None:
    async with connected() as (_, seen):
        await until(lambda: seen.sessions)
        assert 0 < seen.sessions[0].round_trip < 1


async def test_a_reading_waits_for_its_package_as_long_as_for_first_data(
    controller: Controller, connected: Connected, until: Until
) -> None:
    """A controller whose safety set-up is not confirmed accepts starts and sends nothing."""
    controller.script.sends_data = False
    settings = {"inputs": ("input_int_register_0",), "read_back": False, "handshake_timeout": 0.05}
    async with connected(first_data_timeout=0.3, **settings) as (_, seen):
        await until(lambda: seen.losses)
        assert seen.losses[0].reason is LossReason.SILENT
        assert "safety set-up confirmed" in seen.losses[0].text
        controller.script.sends_data = True
        await until(lambda: seen.packages)


@pytest.mark.parametrize("protocol", [1, 2])
@pytest.mark.parametrize("cut", ["packages", "halves", "pairs", "whole"])
async def test_however_the_output_is_cut_into_reads_the_same_comes_of_it(
    cut: str, protocol: int, controller: Controller, connected: Connected, until: Until
) -> None:
    controller.script.sends_data = False
    async with connected(protocol=protocol, every=True) as (client, seen):
        await until(lambda: seen.sessions)
        connection, speaks, layout = client._connection, controller.peer.protocol, seen.sessions[0].outputs
        assert connection is not None
        stamps = [1.0 + 0.002 * number for number in range(12)]
        packages = [speaks.send(messages.DataPackage(1, layout.pack((stamp,)))) for stamp in stamps]
        text = speaks.send(messages.TextMessage("hello", "URControl", messages.TextLevel.INFO))
        foreign = bytes(packages[0][:2]) + b"U\xff" + packages[0][4:]
        unknown = b"\x00" + bytes([len(packages[0])]) + bytes(len(packages[0]) - 2)
        foreigners = [foreign] if protocol > 1 else []  # without an id nothing is foreign
        stream = [*packages[:4], text, *packages[4:7], *foreigners, *packages[7:8], unknown, *packages[8:]]
        joined = b"".join(stream)
        reads = {
            "packages": stream,
            "halves": [half for one in stream for half in (one[:5], one[5:])],
            "pairs": [b"".join(stream[at : at + 2]) for at in range(0, len(stream), 2)],
            "whole": [joined],
        }[cut]
        shown: list[bytes] = []
        for number, read in enumerate(reads):
            if number == len(reads) // 2:
                client.trace(lambda data, _sent, _own: shown.append(data))
            connection.receiver.buffer[: len(read)] = read
            connection.buffer_updated(len(read))
        came = [values[0] for values in (*seen.earlier_packages, *seen.packages)]
        assert sorted(came) == stamps
        assert client.statistics.packages == len(stamps)
        oddities = {one.oddity for one in seen.strange_packages}
        assert oddities == ({Oddity.RECIPE, Oddity.UNKNOWN_TYPE} if foreigners else {Oddity.UNKNOWN_TYPE})
        assert len(seen.texts) == 1
        assert b"".join(shown) == b"".join(reads[len(reads) // 2 :])
        client.trace(None)
        connection.receiver.buffer[:3] = b"\x00\x02U"
        connection.buffer_updated(3)
        await until(lambda: seen.losses)
        assert seen.losses[0].reason is LossReason.PROTOCOL
        assert f"at byte {connection._codec._consumed} of the stream" in seen.losses[0].text
        assert connection._codec._consumed > len(joined)


async def test_a_handler_that_fails_at_a_package_ends_the_client(controller: Controller) -> None:
    class Tired(Notebook):
        def values(self, values: tuple[Scalar, ...], now: float) -> None:
            super().values(values, now)
            if len(self.packages) == 20:
                raise ArithmeticError

    seen = Tired()
    one = RtdeClient(ClientSettings(host="127.0.0.1", port=controller.port), seen)
    with pytest.raises(ArithmeticError):
        await asyncio.wait_for(one.run(), 5)
    assert len(seen.packages) == 20
