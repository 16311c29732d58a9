"""What the robot gets when a PLC dies, hangs, or hangs up: the policy of each variable, and no watchdog."""

from __future__ import annotations

import signal

from tests.e2e.plant import Plant
from tests.e2e.plc import HMI, PLC
from tests.e2e.processes import HOST, Process, Simulator, wait_for

CELL = f"""\
writers:
  plc: {{modbus: {PLC}, timeout: 1s}}
  hmi: {{modbus: {HMI}}}
variables:
  cleared: {{robot: input_int_register_0, modbus: 0,   owner: [plc, hmi], lease: none, on_release: clear}}
  held:    {{robot: input_int_register_1, modbus: 2,   owner: [plc, hmi], lease: none, on_release: hold}}
  valued:  {{robot: input_int_register_2, modbus: 4,   owner: [plc, hmi], lease: none, on_release: -1}}
  bit:     {{robot: input_bit_register_0, modbus: 6.0, owner: [plc, hmi], lease: none, on_release: clear}}
"""
WATCHDOG = ", watchdog: {field: input_int_register_23, frequency: 20, requires: [plc]}"
FED = 1 << 6


def cyclic(plant: Plant, source: str, value: int) -> Process:
    """A client process that has written at least once."""
    client = plant.start("cyclic_client", HOST, plant.modbus, source, value)
    assert client.answer() == "first write 0", client.text()
    return client


def held(simulator: Simulator) -> list[int]:
    fields = [*(f"input_int_register_{number}" for number in range(3)), "input_bit_registers0_to_31"]
    return [simulator.integer(field) for field in fields]


def test_killed_client_frees_its_locks_by_policy(plant: Plant) -> None:
    simulator = plant.simulator()
    daemon = plant.daemon(plant.mapping(CELL, simulator.port))
    hmi = plant.ready_plc(HMI)
    client = cyclic(plant, PLC, 77)
    wait_for(lambda: held(simulator) == [77, 77, 77, 1], "the client's values in the robot")
    assert [hmi.owner(number) for number in range(1, 5)] == [1] * 4

    client.kill()
    took = wait_for(lambda: held(simulator) == [0, 77, -1, 0], "the fallbacks in the robot")
    print(f"client killed -> fallbacks in the robot: {took * 1000:.0f} ms")
    assert [hmi.owner(number) for number in range(1, 5)] == [0] * 4
    assert hmi.status(128) == 0
    daemon.wait_for_line("writer lost", "writer=plc")
    assert hmi.write_integers(0, 5, 6, 7) == 0
    wait_for(lambda: held(simulator) == [5, 6, 7, 0], "the other writer's values")


def test_hanging_client_is_lost_after_its_timeout(plant: Plant) -> None:
    """The connection stays open, but nothing comes: `timeout` counts. Heard again, it writes again."""
    simulator = plant.simulator()
    daemon = plant.daemon(plant.mapping(CELL, simulator.port))
    hmi = plant.ready_plc(HMI)
    client = cyclic(plant, PLC, 77)
    wait_for(lambda: held(simulator) == [77, 77, 77, 1], "the client's values in the robot")

    client.signal(signal.SIGSTOP)
    took = wait_for(lambda: held(simulator) == [0, 77, -1, 0], "the fallbacks in the robot")
    print(f"client hangs, timeout 1 s -> fallbacks in the robot: {took * 1000:.0f} ms")
    assert took > 0.8
    assert hmi.status(128) == 0
    daemon.wait_for_line("writer lost", "writer=plc", "no request for 1 s")
    client.signal(signal.SIGCONT)
    wait_for(lambda: held(simulator) == [77, 77, 77, 1], "the client's values again")
    assert hmi.status(128) == 1


def test_locks_end_with_the_connection_that_works_with_them(plant: Plant) -> None:
    """Another connection of the same writer keeps it alive, and only what is its own."""
    simulator = plant.simulator()
    daemon = plant.daemon(plant.mapping(CELL, simulator.port))
    plc = plant.ready_plc(PLC)
    client = cyclic(plant, PLC, 77)
    wait_for(lambda: held(simulator) == [77, 77, 77, 1], "the client's values in the robot")
    client.kill()
    wait_for(lambda: held(simulator) == [0, 77, -1, 0], "the fallbacks in the robot")
    assert [plc.owner(number) for number in range(1, 5)] == [0] * 4
    assert plc.status(128) == 1
    assert not daemon.lines("writer lost")


def test_client_lost_while_the_robot_is_away(plant: Plant) -> None:
    """The fallbacks fall due when the robot is back: it may have kept the values of a writer that is gone."""
    simulator = plant.simulator()
    plant.daemon(plant.mapping(CELL, simulator.port))
    hmi = plant.ready_plc(HMI)
    client = cyclic(plant, PLC, 77)
    wait_for(lambda: held(simulator) == [77, 77, 77, 1], "the client's values in the robot")
    simulator.kill()
    wait_for(lambda: hmi.robot_state == 0, "the loss of the robot")
    client.kill()
    wait_for(lambda: hmi.owner(1) == 0, "the loss of the client")
    again = plant.simulator(port=simulator.port)
    for number in range(3):
        again.do(f"set input_int_register_{number} 55")
    again.do("set input_bit_registers0_to_31 1")
    wait_for(lambda: held(again) == [0, 55, -1, 0], "the fallbacks that fell due")


def test_watchdog_is_fed_while_robot_gateway_and_writer_live(plant: Plant) -> None:
    simulator = plant.simulator()
    daemon = plant.daemon(plant.mapping(CELL, simulator.port, robot_options=WATCHDOG))
    hmi = plant.ready_plc(HMI)

    def feeds() -> int:
        return simulator.integer("input_int_register_23")

    def still() -> bool:
        """Not fed for ten times its period, seen by the gateway's own heartbeat."""
        before, beat = feeds(), hmi.status(4)
        wait_for(lambda: (hmi.status(4) - beat) % 65536 >= 6, "six heartbeats")
        return feeds() == before

    assert still(), "the required writer was never there"
    client = cyclic(plant, PLC, 7)
    before = feeds()
    wait_for(lambda: feeds() >= before + 10, "ten feeds")
    assert hmi.status(1) & FED
    client.kill()
    wait_for(lambda: not hmi.status(1) & FED, "the end of the feeding")
    assert still(), "the required writer is dead"
    client = cyclic(plant, PLC, 7)
    wait_for(lambda: bool(hmi.status(1) & FED), "the feeding again")
    simulator.do("freeze on")
    wait_for(lambda: not hmi.status(1) & FED, "the end of the feeding of a frozen robot")
    simulator.do("freeze off")
    before = feeds()
    wait_for(lambda: feeds() > before, "the feeding again")
    daemon.kill()
    last = feeds()
    assert simulator.do("clients") == "0" or feeds() == last


def test_watchdog_register_in_use_is_not_fed_and_costs_nothing_else(plant: Plant) -> None:
    simulator = plant.simulator()
    simulator.do("hold input_int_register_23")
    plant.daemon(plant.mapping(CELL, simulator.port, robot_options=WATCHDOG))
    plc = plant.ready_plc()
    assert plc.write_integers(0, 5) == 0
    wait_for(lambda: simulator.integer("input_int_register_0") == 5, "the other registers")
    assert not plc.status(1) & FED
    simulator.do("free input_int_register_23")
    wait_for(
        lambda: plc.write_integers(0, 5) == 0 and simulator.integer("input_int_register_23") > 3,
        "the feeding",
    )
    assert plc.status(1) & FED
