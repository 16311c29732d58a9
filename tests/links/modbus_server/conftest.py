"""A cell with one of everything, and a listener on a free port that serves it."""

from __future__ import annotations

import asyncio
import struct
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from ipaddress import ip_network
from typing import TYPE_CHECKING

import pytest

from gatewayd.core.cell import Cell
from gatewayd.core.definition import (
    CellDefinition,
    Direction,
    Fallback,
    FallbackKind,
    Limits,
    Lock,
    Value,
    ValueKind,
    Variable,
    Writer,
)
from gatewayd.links.modbus_server.functions import Unit
from gatewayd.links.modbus_server.listener import ModbusListener
from gatewayd.links.modbus_server.peers import PeerEvent
from gatewayd.links.modbus_server.plan import ModbusPlan, Placement
from gatewayd.modbus.areas import Area
from gatewayd.modbus.codec import make_codec

if TYPE_CHECKING:
    from tests.links.modbus_server.secured import Certificates

PLC, HMI = 0, 1
NOW = 1000.0

Ask = Callable[..., Awaitable[str]]


class Sketch:
    """Collects variables and placements in the order they are drawn."""

    def __init__(self) -> None:
        self.variables: list[Variable] = []
        self.locks: list[Lock] = []
        self.placements: list[Placement] = []

    def input(
        self,
        name: str,
        kind: ValueKind,
        owners: tuple[int, ...] = (PLC, HMI),
        limits: Limits | None = None,
        *,
        takeover: bool = False,
    ) -> int:
        index = len(self.variables)
        low, high = (-(2**31), 2**31 - 1) if kind is ValueKind.INT else (None, None)
        self.variables.append(
            Variable(
                index + 1,
                name,
                Direction.INPUT,
                kind,
                "in",
                low=low,
                high=high,
                limits=limits,
                lock=len(self.locks),
            )
        )
        self.locks.append(Lock(name, (index,), owners, takeover=takeover))
        return index

    def output(self, name: str, kind: ValueKind, on_stale: FallbackKind = FallbackKind.CLEAR) -> int:
        index = len(self.variables)
        self.variables.append(
            Variable(index + 1, name, Direction.OUTPUT, kind, "out", on_stale=Fallback(on_stale))
        )
        return index

    def bit(self, variable: int, area: Area, address: int, bit: int | None = None) -> None:
        self.placements.append(Placement(variable, area, address, bit, None))

    def number(
        self,
        variable: int,
        area: Area,
        address: int,
        type_name: str,
        *,
        order: str = "ABCD",
        scale: float = 1.0,
    ) -> None:
        kind = self.variables[variable].kind
        low, high = (-(2**31), 2**31 - 1) if kind is ValueKind.INT else (None, None)
        codec = make_codec(type_name, order, kind=kind, scale=scale, low=low, high=high)
        self.placements.append(Placement(variable, area, address, None, codec))


def draw() -> Sketch:
    """Inputs at holding 0, 10..17, 20 and coils 0..9; outputs at holding 20, 100.., 200.., 300.., 500.. and mirrors."""
    sketch = Sketch()
    sketch.bit(sketch.input("start", ValueKind.BOOL, (PLC,)), Area.HOLDING, 0, 0)
    sketch.bit(sketch.input("stop", ValueKind.BOOL, (HMI,)), Area.HOLDING, 0, 1)
    sketch.bit(sketch.input("mode", ValueKind.BOOL), Area.HOLDING, 0, 15)
    sketch.number(sketch.input("part", ValueKind.INT, takeover=True), Area.HOLDING, 10, "uint16")
    sketch.number(sketch.input("count", ValueKind.INT), Area.HOLDING, 11, "int32")
    force = sketch.input("force", ValueKind.FLOAT, limits=Limits(0, 150))
    sketch.number(force, Area.HOLDING, 13, "int16", scale=0.1)
    sketch.number(sketch.input("speed", ValueKind.FLOAT), Area.HOLDING, 14, "float64")
    sketch.bit(sketch.input("half", ValueKind.BOOL), Area.HOLDING, 20, 0)
    for coil in range(10):
        sketch.bit(sketch.input(f"coil_{coil}", ValueKind.BOOL), Area.COIL, coil)
    for register in range(24):
        index = sketch.output(f"int_{register}", ValueKind.INT)
        sketch.number(index, Area.HOLDING, 100 + 2 * register, "int32")
        sketch.number(index, Area.INPUT, 2 * register, "int32")
    for register in range(24):
        sketch.number(
            sketch.output(f"real_{register}", ValueKind.FLOAT), Area.HOLDING, 200 + 4 * register, "float64"
        )
    for bit in range(32):
        index = sketch.output(f"bit_{bit}", ValueKind.BOOL)
        sketch.bit(index, Area.HOLDING, 500 + bit // 16, bit % 16)
        sketch.bit(index, Area.DISCRETE, bit + 3)
    fragile = sketch.output("fragile", ValueKind.INT, FallbackKind.EXCEPTION)
    sketch.number(fragile, Area.HOLDING, 300, "uint16")
    sketch.bit(sketch.output("fragile_bit", ValueKind.BOOL, FallbackKind.EXCEPTION), Area.DISCRETE, 40)
    sketch.number(sketch.output("swapped", ValueKind.FLOAT), Area.HOLDING, 301, "float32", order="CDAB")
    sketch.number(sketch.output("clipped", ValueKind.FLOAT), Area.HOLDING, 303, "int16")
    sketch.bit(sketch.output("other_half", ValueKind.BOOL), Area.HOLDING, 20, 1)
    sketch.bit(sketch.output("lamp", ValueKind.BOOL), Area.COIL, 10)
    return sketch


def make_cell(sketch: Sketch) -> Cell:
    definition = CellDefinition(
        name="press-3",
        fingerprint=0x1234ABCD,
        variables=tuple(sketch.variables),
        locks=tuple(sketch.locks),
        writers=(Writer("plc"), Writer("hmi")),
        stale_after=0.1,
    )
    return Cell(definition)


def make_plan(
    sketch: Sketch,
    unit: int = 1,
    allow: tuple[str, ...] = (),
    connections: int = 32,
    idle_timeout: float | None = None,
    *,
    fill_gaps: bool = False,
) -> ModbusPlan:
    return ModbusPlan(
        host="127.0.0.1",
        port=0,
        unit=unit,
        allow=tuple(ip_network(network) for network in allow),
        connections=connections,
        idle_timeout=idle_timeout,
        fill_gaps=fill_gaps,
        placements=tuple(sketch.placements),
        writers=((ip_network("127.0.0.2/32"), PLC), (ip_network("127.0.0.3/32"), HMI)),
    )


def bring_up(cell: Cell, now: float) -> None:
    """Connect the robot: every variable good, all values zero."""
    cell.robot_connected(now)
    cell.adopt({}, now)
    cell.package_arrived(1.0, now)
    cell.outputs_written(now)


@pytest.fixture
def sketch() -> Sketch:
    return draw()


@pytest.fixture
def plan_of(sketch: Sketch) -> Callable[..., ModbusPlan]:
    """Makes plans of the drawn cell; see `make_plan`."""

    def make(unit: int = 1, *, fill_gaps: bool = False, **limits: object) -> ModbusPlan:
        return make_plan(sketch, unit, fill_gaps=fill_gaps, **limits)  # type: ignore[arg-type]  # passed on as they are

    return make


@pytest.fixture
def new_cell(sketch: Sketch) -> Callable[[float], Cell]:
    """Makes cells like the drawn one, with the robot connected at the given time."""

    def make(now: float) -> Cell:
        cell = make_cell(sketch)
        bring_up(cell, now)
        return cell

    return make


@pytest.fixture
def cell(new_cell: Callable[[float], Cell]) -> Cell:
    """For tests without sockets, at time 1000."""
    return new_cell(NOW)


@pytest.fixture
def unit(cell: Cell, plan_of: Callable[..., ModbusPlan]) -> Iterator[Unit]:
    unit = Unit(plan_of(), cell)
    yield unit
    unit.close()


@pytest.fixture
def index_of(sketch: Sketch) -> Callable[[str], int]:
    """Index of a variable by its name."""
    return {variable.name: index for index, variable in enumerate(sketch.variables)}.__getitem__


@pytest.fixture
def show(cell: Cell, index_of: Callable[[str], int]) -> Callable[..., None]:
    """Lets the robot send new values: `show(int_0=5)`."""

    def send(**values: Value) -> None:
        for name, value in values.items():
            cell.image.values[index_of(name)] = value
        cell.outputs_written(NOW)

    return send


@pytest.fixture
def events() -> list[PeerEvent]:
    """What the listener reported of its connections."""
    return []


@pytest.fixture
def live_cell(new_cell: Callable[[float], Cell]) -> Cell:
    """For tests with sockets, at the present time; what a busy machine delays does not become stale."""
    cell = new_cell(time.monotonic())
    cell.freshness.stale_after = 3600.0
    return cell


@pytest.fixture
async def listener(
    live_cell: Cell, plan_of: Callable[..., ModbusPlan], events: list[PeerEvent]
) -> AsyncIterator[ModbusListener]:
    """Serves `live_cell` as unit 1 on a free port of the loopback."""
    listener = ModbusListener("127.0.0.1", 0, observe=events.append)
    listener.serve([(plan_of(), live_cell)])
    await listener.start()
    yield listener
    await listener.close()


@pytest.fixture
async def ask(listener: ModbusListener) -> AsyncIterator[Ask]:
    """Sends a PDU, written in hexadecimal, from an address and returns the answer's PDU; "" if the server closed."""
    streams: dict[str, tuple[asyncio.StreamReader, asyncio.StreamWriter]] = {}
    transactions = iter(range(1, 65536))

    async def ask(pdu: str, source: str = "127.0.0.2", unit: int = 1) -> str:
        if source not in streams:
            streams[source] = await asyncio.open_connection(
                "127.0.0.1", listener.port, local_addr=(source, 0)
            )
        reader, writer = streams[source]
        body = bytes.fromhex(pdu)
        transaction = next(transactions)
        writer.write(struct.pack(">HHHB", transaction, 0, len(body) + 1, unit) + body)
        try:
            head = await reader.readexactly(7)
        except asyncio.IncompleteReadError:
            return ""
        answered, protocol, length, echoed = struct.unpack(">HHHB", head)
        assert (answered, protocol, echoed) == (transaction, 0, unit)
        return (await reader.readexactly(length - 1)).hex(" ")

    yield ask
    for _reader, writer in streams.values():
        writer.close()


@pytest.fixture(scope="session")
def certificates(tmp_path_factory: pytest.TempPathFactory) -> Certificates:
    """Of a listener with TLS and its clients, made by the program openssl."""
    from tests.links.modbus_server.secured import make_certificates

    return make_certificates(tmp_path_factory.mktemp("certificates"))
