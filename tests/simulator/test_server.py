"""The simulated controller over real sockets."""

from __future__ import annotations

import asyncio
import logging
import math
import socket
import struct
from itertools import pairwise
from typing import TYPE_CHECKING, cast

import pytest

from gatewayd.rtde.messages import (
    DataPackage,
    InputsSetup,
    ProtocolVersionReply,
    RequestProtocolVersion,
    SetupInputs,
    Start,
    TextMessage,
)
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.faults import DropAt, Faults, FaultStep
from gatewayd.simulator.program import DEMO, parse
from gatewayd.simulator.server import SimulatedController

if TYPE_CHECKING:
    from tests.simulator.conftest import Client

INT = "input_int_register_{}".format


def served(faults: Faults | None = None, program: str = "", connections: int = 16) -> SimulatedController:
    return SimulatedController(Controller(program=parse(program), faults=faults), connections=connections)


async def alone(simulator: SimulatedController) -> None:
    """Returns when the controller has noticed that one client is left."""
    async with asyncio.timeout(10):
        while simulator.clients > 1:  # noqa: ASYNC110 - the simulator announces it to nobody
            await asyncio.sleep(0.005)


async def test_timestamps_step_by_one_period(simulator: SimulatedController, client: type[Client]) -> None:
    async with client(simulator.port) as one:
        await one.stream("timestamp", frequency=125)
        stamps = [float((await one.package())[0]) for _ in range(50)]
    steps = [(b - a) / 0.008 for a, b in pairwise(stamps)]
    assert all(abs(step - round(step)) < 1e-6 and round(step) >= 1 for step in steps)
    assert sorted(steps)[len(steps) // 2] == pytest.approx(1)


async def test_two_clients_see_each_others_inputs_and_the_programs_answer(client: type[Client]) -> None:
    async with (
        served(program=DEMO) as simulator,
        client(simulator.port) as reader,
        client(simulator.port) as writer,
    ):
        await reader.stream("timestamp", INT(3), "output_int_register_3")
        assert await writer.negotiate()
        assert (await writer.inputs(INT(3))).recipe == 1
        writer.send(DataPackage(1, struct.pack(">i", -77)))
        assert (await reader.until(lambda values: values[2] == -77))[1] == -77


async def test_a_closed_connection_frees_its_claims(
    simulator: SimulatedController, client: type[Client]
) -> None:
    async with client(simulator.port) as other:
        async with client(simulator.port) as one:
            assert (await one.inputs(INT(0))).recipe == 1
            assert (await other.inputs(INT(0))).types == ("IN_USE",)
        await alone(simulator)
        assert (await other.inputs(INT(0))).recipe == 1


async def test_claims_may_linger(client: type[Client]) -> None:
    async with served(Faults(linger=0.15)) as simulator, client(simulator.port) as other:
        async with client(simulator.port) as one:
            await one.inputs(INT(0))
        await alone(simulator)
        assert (await other.inputs(INT(0))).types == ("IN_USE",)
        await asyncio.sleep(0.3)
        assert (await other.inputs(INT(0))).recipe == 1


async def test_malformed_bytes_cost_only_their_own_connection(
    simulator: SimulatedController, client: type[Client], caplog: pytest.LogCaptureFixture
) -> None:
    async with client(simulator.port) as good, client(simulator.port) as bad:
        await good.stream("timestamp")
        bad.writer.write(b"\0\0\0\0")
        await bad.ended()
        await good.package()
    assert simulator.malformed == 1
    assert "package size 0 is less than its own header" in caplog.text


async def test_a_type_that_it_does_not_know_is_met_with_silence_and_logged_once(
    simulator: SimulatedController, client: type[Client], caplog: pytest.LogCaptureFixture
) -> None:
    """READ_PROPERTIES (82) is unknown to controllers before 5.27: they say nothing."""
    caplog.set_level(logging.INFO)
    async with client(simulator.port) as one:
        for _ in range(3):
            one.writer.write(b"\x00\x03\x52")
        await one.stream("timestamp")
        await one.package()
    assert caplog.text.count("unknown package type 82, not answered") == 1
    assert simulator.malformed == 0


async def test_bytes_as_they_are_go_to_every_client(
    simulator: SimulatedController, client: type[Client]
) -> None:
    async with client(simulator.port) as one, client(simulator.port) as other:
        await one.negotiate()
        await other.negotiate()
        simulator.raw(bytes.fromhex("0008 4d 02 6869 00 01"))
        for each in (one, other):
            assert (await each.receive(TextMessage)).message == "hi"


async def test_too_many_clients_are_turned_away(client: type[Client]) -> None:
    async with served(connections=1) as simulator, client(simulator.port) as one:
        assert await one.negotiate()
        async with client(simulator.port) as two:
            await two.ended()
        assert (simulator.clients, simulator.refused) == (1, 1)
        assert await one.negotiate()


async def test_a_client_that_does_not_read_is_dropped(client: type[Client]) -> None:
    async with served(Faults(overflow_close=0.1)) as simulator, client(simulator.port) as reader:
        await reader.stream("timestamp")
        loop = asyncio.get_running_loop()
        with socket.socket() as deaf:
            deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            deaf.setblocking(False)
            await loop.sock_connect(deaf, ("127.0.0.1", simulator.port))
            fields = b"actual_q," * 1000
            requests = struct.pack(">HBH", 5, ord("V"), 2)
            requests += struct.pack(">HBd", 11 + len(fields), ord("O"), 500.0) + fields
            await loop.sock_sendall(deaf, requests + struct.pack(">HB", 3, ord("S")))
            async with asyncio.timeout(10):
                while not simulator.overflowed or simulator.clients > 1:
                    await reader.package()
        assert simulator.clients == 1
        await reader.package()


async def test_a_greeting_precedes_every_answer(client: type[Client]) -> None:
    async with served(Faults(text_on_connect="not confirmed")) as simulator, client(simulator.port) as one:
        assert (await one.receive(TextMessage)).message == "not confirmed"
        one.send(RequestProtocolVersion(2))
        assert (await one.receive(ProtocolVersionReply)).accepted


async def test_the_boot_restart_begins_again_on_the_same_port(client: type[Client]) -> None:
    async with served(Faults(boot_restart=0.3)) as simulator:
        port = simulator.port
        async with client(port) as one:
            await one.stream("timestamp")
            assert float((await one.package())[0]) < 1
            await one.ended()
        for _ in range(100):
            try:
                async with client(port) as again:
                    await again.stream("timestamp")
                    assert float((await again.package())[0]) < 0.3
                break
            except ConnectionError:
                await asyncio.sleep(0.05)
        else:
            pytest.fail("never came back")


async def test_freeze_and_silence_can_be_thrown_at_run_time(
    simulator: SimulatedController, client: type[Client]
) -> None:
    async with client(simulator.port) as one:
        await one.stream("timestamp")
        simulator.faults.freeze = True
        stamp = (await one.package())[0]
        repeated = await one.until(lambda values: values[0] == simulator.get("timestamp"))
        assert float(repeated[0]) >= float(stamp)
        assert await one.package() == repeated
        simulator.faults.freeze = False
        await one.until(lambda values: values != repeated)
        simulator.faults.silence = True
        assert await one.negotiate()  # what was under way is read
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(one.package(), 0.15)
        assert await one.negotiate()


@pytest.mark.parametrize("fault", ["drop", "duplicate", "split"])
async def test_mangled_streams_stay_readable(client: type[Client], fault: str) -> None:
    faults = Faults(seed=4)
    setattr(faults, fault, 0.4)
    async with served(faults) as simulator, client(simulator.port) as one:
        await one.stream("timestamp", "actual_q")
        stamps = [float((await one.package())[0]) for _ in range(60)]
    steps = [round((b - a) * 500) for a, b in pairwise(stamps)]
    assert min(steps) >= (0 if fault == "duplicate" else 1)
    if fault == "drop":
        assert max(steps) > 1
    if fault == "duplicate":
        assert 0 in steps


async def test_hold_and_free_at_run_time(simulator: SimulatedController, client: type[Client]) -> None:
    async with client(simulator.port) as one:
        simulator.controller.hold([INT(3)])
        assert (await one.inputs(INT(2), INT(3))).types == ("INT32", "IN_USE")
        simulator.controller.free([INT(3)])
        assert (await one.inputs(INT(2), INT(3))).recipe == 1
        with pytest.raises(ValueError, match=r"input_int_register_3 is in use by client 1 \(127.0.0.1:"):
            simulator.controller.hold([INT(3)])


async def test_values_are_at_hand(simulator: SimulatedController) -> None:
    simulator.set("output_double_register_3", 1.5)
    assert simulator.get("output_double_register_3") == 1.5
    assert simulator.get("payload_cog") == (0.0, 0.0, 0.06)
    with pytest.raises(KeyError):
        simulator.get("nothing")


async def test_a_split_request_is_put_together(simulator: SimulatedController, client: type[Client]) -> None:
    async with client(simulator.port) as one:
        for byte in one.protocol.send(SetupInputs((INT(0),))):
            one.writer.write(bytes([byte]))
            await asyncio.sleep(0.002)
        assert (await one.receive(InputsSetup)).recipe == 1


async def test_stop_and_start_keep_port_and_values(
    simulator: SimulatedController, client: type[Client]
) -> None:
    simulator.set(INT(0), 5)
    port = simulator.port
    async with client(port) as one:
        await one.stream("timestamp")
        await simulator.stop()
        await one.ended()
    await simulator.start()
    assert (simulator.port, simulator.get(INT(0)), simulator.clients) == (port, 5, 0)


async def test_a_port_in_use_is_an_error(simulator: SimulatedController) -> None:
    with pytest.raises(OSError, match="address already in use"):
        await SimulatedController(port=simulator.port).start()


async def test_a_pause_stops_everything_and_leaves_the_clock_behind(
    simulator: SimulatedController, client: type[Client]
) -> None:
    """Nothing is sent, nobody is answered; the timestamp goes on by one step, as if no time had passed."""
    loop = asyncio.get_running_loop()
    async with client(simulator.port) as one, client(simulator.port) as other:
        await one.stream("timestamp")
        await other.negotiate()
        await one.package()
        simulator.pause(0.4)
        start = loop.time()
        assert simulator.paused
        other.send(RequestProtocolVersion(2))
        async with client(simulator.port) as late:
            await late.negotiate()
            assert loop.time() - start > 0.35
        await other.receive(ProtocolVersionReply)
        stamps = [float((await one.package())[0]) for _ in range(100)]
        assert max(after - before for before, after in pairwise(stamps)) < 0.2
        assert stamps[-1] - stamps[0] < loop.time() - start - 0.3


async def test_a_dropped_connection_gives_its_claims_back(client: type[Client]) -> None:
    async with served(Faults(drop_at=DropAt(FaultStep.START), drop_times=math.inf)) as simulator:
        for _ in range(2):
            async with client(simulator.port) as one:
                await one.negotiate()
                assert (await one.inputs(INT(0))).recipe == 1
                await one.outputs("timestamp")
                one.send(Start())
                await one.ended()


async def test_what_is_overwritten_shows_in_the_read_back(
    simulator: SimulatedController, client: type[Client]
) -> None:
    async with client(simulator.port) as one:
        await one.stream(INT(0))
        await one.inputs(INT(0))
        simulator.controller.overwrite(INT(0), [99])
        one.send(DataPackage(1, struct.pack(">i", 5)))
        await one.until(lambda values: values == (99,))
        simulator.controller.overwrite(INT(0), None)
        one.send(DataPackage(1, struct.pack(">i", 6)))
        await one.until(lambda values: values == (6,))


async def test_a_stepped_controller_sends_one_package_for_each_step(client: type[Client]) -> None:
    async with SimulatedController(stepped=True) as stepped, client(stepped.port) as one:
        await one.stream("timestamp")
        for cycle in range(1, 6):
            await stepped.step()
            assert await one.package() == pytest.approx((100 + cycle / 500,))
        await stepped.step(3)
        assert [(await one.package())[0] for _ in range(3)] == pytest.approx([100.012, 100.014, 100.016])


async def test_steps_lose_nothing_however_many_there_are(client: type[Client]) -> None:
    """Far more packages than the socket holds: the steps wait for a client that reads."""
    names = [f"output_double_register_{number}" for number in range(48)]
    async with SimulatedController(stepped=True) as stepped, client(stepped.port) as one:
        await one.stream("timestamp", *names)
        steps = asyncio.create_task(stepped.step(3000))
        stamps = [(await one.package())[0] for _ in range(3000)]
        await steps
    assert stamps == pytest.approx([100 + cycle / 500 for cycle in range(1, 3001)])


async def test_steps_do_not_wait_for_ever_for_a_client_that_does_not_read(client: type[Client]) -> None:
    names = [f"output_double_register_{number}" for number in range(48)]
    faults = Faults(overflow_close=0.05)
    stepped = SimulatedController(Controller(faults=faults), stepped=True)
    async with stepped, client(stepped.port) as one:
        await one.stream("timestamp", *names)
        cast("asyncio.Transport", one.writer.transport).pause_reading()
        while not stepped.overflowed:
            await stepped.step(1000)
        assert stepped.clients == 0


async def test_only_a_stepped_controller_has_steps(simulator: SimulatedController) -> None:
    with pytest.raises(RuntimeError, match="--stepped, stepped=True"):
        await simulator.step()


@pytest.mark.parametrize("speed, stepped", [(0, False), (-1.0, False), (math.nan, False), (2.0, True)])
def test_a_speed_that_cannot_be_meant_is_refused(speed: float, stepped: bool) -> None:
    with pytest.raises(ValueError, match="a speed of"):
        SimulatedController(speed=speed, stepped=stepped)


@pytest.mark.parametrize("speed", [0.1, 20.0])
async def test_another_speed_leaves_each_cycle_as_it_is(client: type[Client], speed: float) -> None:
    async with SimulatedController(speed=speed) as served, client(served.port) as one:
        await one.stream("timestamp")
        began = asyncio.get_running_loop().time()
        stamps = [(await one.package())[0] for _ in range(200 if speed > 1 else 20)]
        passed = asyncio.get_running_loop().time() - began
    steps = [round((b - a) * 500) for a, b in pairwise(stamps)]
    assert min(steps) == 1
    # No bound for a busy machine: it only makes the controller skip, and its time never outruns its speed.
    assert (stamps[-1] - stamps[0]) < (passed + 0.5) * speed + 0.1
