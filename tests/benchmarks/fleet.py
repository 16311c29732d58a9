"""Many cells and one broker: a process for each cell, a thousand edge nodes without robots, a broker that is away."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from tests.benchmarks.fleet_nodes import HOUR, STEP
from tests.benchmarks.growth import FREQUENCY
from tests.benchmarks.growth_robots import host as address_of_robot
from tests.benchmarks.image import one_of_many
from tests.benchmarks.plc import Plc
from tests.benchmarks.processes import free_port, python, running
from tests.benchmarks.report import Table, percentile
from tests.benchmarks.samples import NOISE, RULE, Samples
from tests.benchmarks.servers import FRESH, ROBOT_STATE
from tests.benchmarks.trees import HERE, Job
from tests.benchmarks.usage import Usage, usage
from tests.e2e.processes import Process, wait_for
from tests.peers.mosquitto import BrokerOptions, Mosquitto

PROCESSES = (1, 10, 30)
NODES = 1000
METRICS = 10
AWAY = 25.0
"""Seconds for which the broker is really away: the pauses between two attempts have their full length by then."""
PATIENCE = 180.0
QUIET = BrokerOptions(more=("log_dest none", "max_queued_messages 0"))
"""No log, and nothing of QoS 0 is dropped for a host that is slow for a moment."""
MQTT = """\
mqtt: {{host: {host}, port: {port}, sparkplug: {{group: bench, node: gateway-{number}}}}}
"""

OF_PROCESSES = f"""\
One gatewayd for each cell, with the full image, a robot at {FREQUENCY} Hz, and all values that change once a second to
one mosquitto, by Sparkplug. Robots are one process, whose CPU time is not counted. {RULE}"""
OF_NODES = f"""\
{NODES:,} edge nodes without robots in one process, each with its own connection to one mosquitto, one device and
{METRICS + 1} metrics that all change once a second (one DDATA). A host application hears and decodes everything. Time
until seen: from the change to the decoded value. Nodes, broker and host share this machine. {RULE}"""
OF_ABSENCE = f"""\
The same nodes; the host application is their primary host. Asked for: the host asks each of them for a rebirth.
Restart: mosquitto is killed and started again. Away for an hour: mosquitto is really away for {AWAY:g} s, so that the
nodes' attempts are as far apart as they will ever be; meanwhile the clocks of the nodes' values are moved on by
{HOUR:g} s with a change every {STEP:g} s, which is simulated time. Spread: between the first and the last."""


def run(job: Job) -> list[Table]:
    """Three tables, where mosquitto is installed."""
    if shutil.which("mosquitto", path=f"{os.environ.get('PATH', '')}:/usr/sbin") is None:
        return [Table("Fleet", "mosquitto is not installed (Debian package mosquitto): not measured", ("",))]
    samples = Samples()
    return [_processes(job, samples), *_nodes(job, samples)]


# -- processes -------------------------------------------------------------------------------------------------------


def _processes(job: Job, samples: Samples) -> Table:
    table = Table(
        "Fleet: a process for each cell", OF_PROCESSES, ("cells", "CPU each", "memory each", "broker", *NOISE)
    )
    for count in PROCESSES:
        with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
            broker = stack.enter_context(_broker(Path(folder, "broker")))
            robot = free_port()
            robots = python("-m", "tests.benchmarks.growth_robots", str(count), str(robot), str(FREQUENCY))
            stack.enter_context(running(robots)).answer()
            gateways = [
                stack.enter_context(_gateway(Path(folder), number, robot, broker)) for number in range(count)
            ]
            work = partial(_cpu, [broker.process, *gateways], max(job.seconds, 5.0))
            of_broker, *of_gateways = samples.take(f"{count} processes", gateways[0].pid, work)
            memory = sum(one.resident_kilobytes() for one in gateways) / 1024 / count
            table.add(
                str(count),
                f"{sum(of_gateways) / count:.1f} %",
                f"{memory:.0f} MB",
                f"{of_broker:.1f} %",
                *samples.noise(f"{count} processes"),
            )
    table.note = samples.note
    return table


@contextmanager
def _gateway(folder: Path, number: int, robot: int, broker: Mosquitto) -> Iterator[Process]:
    """One that serves a cell, with fresh values."""
    modbus = free_port()
    path = folder / f"{number}.yaml"
    text = one_of_many(number, address_of_robot(number), robot, modbus, FREQUENCY)
    section = MQTT.format(host=broker.host, port=broker.port, number=number)
    path.write_text(text.replace("writers:", f"{section}writers:"))
    command = HERE.gatewayd("run", str(path), "--control", "none", "--state", str(folder))
    with running(command, modbus) as process:
        plc = Plc(modbus, number + 1)
        wait_for(lambda: plc.read(ROBOT_STATE, 1) == bytes((0, FRESH)), "fresh values", PATIENCE)
        plc.close()
        yield process


# -- nodes -----------------------------------------------------------------------------------------------------------


def _nodes(job: Job, samples: Samples) -> list[Table]:
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        broker, host, nodes = plant(stack, Path(folder))
        return [_load(job, samples, broker, host, nodes), absence(broker, host, nodes)]


def plant(stack: ExitStack, folder: Path) -> tuple[Mosquitto, Process, Process]:
    """Broker, host application and nodes, when all nodes are born."""
    broker = stack.enter_context(_broker(folder))
    address = (broker.host, str(broker.port))
    host = stack.enter_context(running(python("-m", "tests.benchmarks.fleet_host", *address)))
    host.answer()
    _until(lambda: bool(_ask(host)["connected"]), "the host")
    arguments = (*address, str(NODES), str(METRICS), "1")
    nodes = stack.enter_context(running(python("-m", "tests.benchmarks.fleet_nodes", *arguments)))
    nodes.answer()
    _births(host)
    return broker, host, nodes


def _load(job: Job, samples: Samples, broker: Mosquitto, host: Process, nodes: Process) -> Table:
    seconds = max(job.seconds, 10.0)

    def measure() -> tuple[list[float], dict[str, Any], list[float]]:
        _ask(host)
        before = _ask(nodes)
        shares = _cpu([broker.process, nodes, host], seconds)
        seen, after = _ask(host), _ask(nodes)
        return shares, seen, [after[key] - before[key] for key in ("messages", "bytes")]

    (of_broker, of_nodes, of_host), seen, (messages, size) = samples.take("nodes", nodes.pid, measure)
    delays = seen["delays"]
    table = Table(f"Fleet: {NODES:,} edge nodes", OF_NODES, ("what", "value", *NOISE))
    table.add("messages a second", f"{messages / seconds:,.0f}", *samples.noise("nodes"))
    table.add("bytes a second for each node, topic and payload", f"{size / seconds / NODES:,.0f}")
    table.add("time until seen, p50", f"{percentile(delays, 0.5) * 1000:.1f} ms")
    table.add("time until seen, p99", f"{percentile(delays, 0.99) * 1000:.1f} ms")
    table.add("gaps in the sequence numbers", str(seen["gaps"]))
    table.add("CPU of mosquitto", f"{of_broker:.1f} % of a core")
    table.add("memory of mosquitto", f"{broker.process.resident_kilobytes() / 1024:.0f} MB")
    table.add("CPU of all nodes", f"{of_nodes:.1f} % of a core")
    table.add("memory of all nodes", f"{nodes.resident_kilobytes() / 1024:.0f} MB")
    table.add("CPU of the host application", f"{of_host:.1f} % of a core")
    table.note = samples.note
    return table


def absence(broker: Mosquitto, host: Process, nodes: Process) -> Table:
    """Births that are asked for, after a restart of the broker, and after an hour without it."""
    header = (
        "what",
        "connections, spread",
        "births, spread",
        "most in 100 ms",
        "all born after",
        "caught up",
        "gaps",
    )
    table = Table("Fleet: births and absence", OF_ABSENCE, header)

    begin = time.monotonic()
    _ask(host, "rebirth")
    born = _births(host)
    table.add("asked for", "-", *_spread(born), f"{born[-1] - begin:.1f} s")

    broker.kill()
    _until(lambda: _ask(nodes)["connected"] == 0, "the loss")
    begin = _back(broker, host)
    born = _births(host)
    table.add("restart", _spread(_ask(nodes)["begun"])[0], *_spread(born), f"{born[-1] - begin:.1f} s")

    broker.kill()
    away = time.monotonic()
    _until(lambda: _ask(nodes)["connected"] == 0, "the loss")
    kept = _ask(nodes, "hour")
    time.sleep(max(0.0, away + AWAY - time.monotonic()))
    begin = _back(broker, host)
    born = _births(host, "look")
    connections = _spread(_ask(nodes)["begun"])[0]
    _until(lambda: _ask(nodes)["stored"] == 0 and _is_quiet(host), "the values of the hour")
    seen = _ask(host)
    caught_up = f"{seen['historical']:,} of {kept['stored']:,.0f} values in {seen['last'] - begin:.1f} s"
    table.add(
        "away for an hour",
        connections,
        *_spread(born),
        f"{born[-1] - begin:.1f} s",
        caught_up,
        str(seen["gaps"]),
    )
    memory = nodes.resident_kilobytes() / 1024
    table.note = f"Nodes with an hour of values: {memory:.0f} MB; dropped: {kept['dropped']:.0f}."
    return table


def _back(broker: Mosquitto, host: Process) -> float:
    """The broker is there again, and nothing from before counts; when that was."""
    _ask(host)
    broker.start()
    return time.monotonic()


def _births(host: Process, word: str = "state") -> list[float]:
    """When each node was born first since the host was asked last."""
    _until(lambda: len(_ask(host, "look")["born"]) == NODES, "the births")
    born: list[float] = _ask(host, word)["born"]
    return born


def _until(condition: Callable[[], bool], what: str) -> None:
    """Wait, and ask no more often than twice a second: answers cost those who are measured time."""
    end = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError(f"waited in vain for {what}")
        time.sleep(0.5)


def _is_quiet(host: Process) -> bool:
    """Whether no value of before came for two seconds."""
    seen = _ask(host, "look")
    return bool(seen["now"] - seen["last"] > 2)


def _spread(moments: Sequence[float]) -> tuple[str, str]:
    most = max(sum(at <= other < at + 0.1 for other in moments) for at in moments)
    return f"{moments[-1] - moments[0]:.1f} s", str(most)


# -- both ------------------------------------------------------------------------------------------------------------


@contextmanager
def _broker(folder: Path) -> Iterator[Mosquitto]:
    broker = Mosquitto(folder, QUIET)
    try:
        yield broker
    finally:
        broker.kill()


def _ask(program: Process, command: str = "state") -> dict[str, Any]:
    assert program.popen.stdin is not None
    program.popen.stdin.write(command + "\n")
    answer: dict[str, Any] = json.loads(program.answer())
    return answer


def _cpu(programs: Sequence[Process], seconds: float) -> list[float]:
    """Percent of a core that each has used."""
    before = [usage(program.pid) for program in programs]
    time.sleep(seconds)
    return [_share(usage(program.pid) - former) for program, former in zip(programs, before, strict=True)]


def _share(used: Usage) -> float:
    return 100 * used.cpu / used.wall
