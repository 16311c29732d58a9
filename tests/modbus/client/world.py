"""A line and its units in made time: what is sent is answered after a while, in the same process, without a socket."""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field

from gatewayd.modbus.areas import Area
from gatewayd.modbus.client import pdus
from gatewayd.modbus.client.conversation import Conversation, TcpConversation
from gatewayd.modbus.client.grouping import PollClass, ReadGroup, WantedItem, plan_classes
from gatewayd.modbus.client.identity import UnitIdentity
from gatewayd.modbus.client.line import Line, LineSettings
from gatewayd.modbus.client.requests import Failure
from gatewayd.modbus.client.station import Station
from gatewayd.modbus.client.unit import StationSettings, UnitState
from gatewayd.modbus.frames import encode, split


@dataclass
class Heard:
    """What a station has reported."""

    values: list[tuple[ReadGroup, bytes]] = field(default_factory=list)
    failures: list[Failure] = field(default_factory=list)
    written: list[tuple[Hashable, Failure | None]] = field(default_factory=list)
    states: list[tuple[UnitState, str, float]] = field(default_factory=list)
    identities: list[tuple[UnitIdentity, UnitIdentity | None]] = field(default_factory=list)
    order: list[str] = field(default_factory=list)
    when_written: Callable[[Hashable], object] = lambda _key: None

    def values_read(self, group: ReadGroup, data: bytes, now: float) -> None:
        self.values.append((group, data))
        self.order.append("values")

    def read_failed(self, group: ReadGroup, failure: Failure, now: float) -> None:
        self.failures.append(failure)
        self.order.append("failed")

    def write_done(self, key: Hashable, failure: Failure | None, now: float) -> None:
        self.written.append((key, failure))
        self.when_written(key)
        self.order.append("written")

    def state_changed(self, state: UnitState, reason: str, now: float) -> None:
        self.states.append((state, reason, now))
        self.order.append(state.value)

    def connection_renewed(self, now: float) -> None:
        self.order.append("renewed")

    def identified(self, identity: UnitIdentity, former: UnitIdentity | None, now: float) -> None:
        self.identities.append((identity, former))
        self.order.append("identified")


Change = Callable[[bytes], bytes | None]
"""A frame's PDU -> what is sent instead; None: nothing."""


class Unit:
    """Registers and coils, and what goes wrong with their answers."""

    def __init__(self) -> None:
        self.registers: dict[int, int] = {}
        self.bits: dict[int, bool] = {}
        self.functions = {1, 2, 3, 4, 5, 6, 15, 16, 22, 23}
        self.delay = 0.002
        self.change: Change = lambda pdu: pdu
        self.requests: list[bytes] = []

    def answer(self, pdu: bytes) -> bytes | None:
        self.requests.append(pdu)
        return self.change(self._answer(pdu))

    def _answer(self, pdu: bytes) -> bytes:
        function = pdu[0]
        address, number = int.from_bytes(pdu[1:3]), int.from_bytes(pdu[3:5])
        if function not in self.functions:
            return bytes((function | 0x80, 1))
        if function in (1, 2):
            bits = sum(self.bits.get(address + place, False) << place for place in range(number))
            data = bits.to_bytes((number + 7) // 8, "little")
            return bytes((function, len(data))) + data
        if function in (3, 4):
            words = (self.registers.get(address + place, 0) for place in range(number))
            return bytes((function, 2 * number)) + b"".join(word.to_bytes(2) for word in words)
        if function == 5:
            self.bits[address] = number != 0
        elif function == 6:
            self.registers[address] = number
        elif function == 15:
            bits = int.from_bytes(pdu[6:], "little")
            self.bits |= {address + place: bool(bits >> place & 1) for place in range(number)}
        elif function == 16:
            for place in range(number):
                self.registers[address + place] = int.from_bytes(pdu[6 + 2 * place : 8 + 2 * place])
        elif function == 22:
            and_mask, or_mask = number, int.from_bytes(pdu[5:7])
            self.registers[address] = self.registers.get(address, 0) & and_mask | or_mask & ~and_mask
            return pdu
        return pdu[:5]


class World:
    """Time, a line, and the units behind one gateway, which serves one request after the other."""

    def __init__(
        self, line: Line, units: dict[int, Unit], conversation: Callable[[], Conversation] | None = None
    ):
        self.line = line
        self.units = units
        self.now = 0.0
        self.sent: list[tuple[float, int, bytes]] = []
        """Time, unit, PDU of each request."""
        self.breaks = 0
        self._conversation = conversation or (lambda: TcpConversation(line.settings.in_flight))
        self._coming: list[tuple[float, int, bytes]] = []
        self._number = itertools.count()
        self._is_open = False
        self._is_serial = False
        self.is_reachable = True

    def use(self, conversation: Callable[[], Conversation]) -> None:
        """Speak RTU from the next connection on."""
        self._conversation = conversation
        self._is_serial = True

    def run(self, seconds: float) -> None:
        """Let so much time pass."""
        end = self.now + seconds
        while True:
            self._turn()
            if self.is_reachable and not self._is_open:
                continue
            upcoming = self._coming[0][0] if self._coming else float("inf")
            following = min(upcoming, self.line.wake_at())
            if following > end:
                self.now = end
                self._turn()
                return
            assert following > self.now - 1e-9 or following == float("-inf"), "the line does not sleep"
            self.now = max(self.now, following)
            if upcoming <= self.now:
                _, _, frame = heapq.heappop(self._coming)
                self.close(self.line.received(frame, self.now))

    def _turn(self) -> None:
        if not self._is_open and self.is_reachable:
            self._is_open = True
            self.line.connected(self._conversation(), self.now)
        if self._is_open and not self.is_reachable:
            self.close("the cable was pulled")
        self.close(self.line.check(self.now))
        if self.line.is_spent:
            self._is_open = False
            self.line.disconnected("", self.now)
            self._turn()
        while self._is_open and (frame := self.line.next_frame(self.now)) is not None:
            self._serve(frame)

    def close(self, reason: str) -> None:
        if reason:
            self._is_open = False
            self.breaks += 1
            self._coming.clear()
            self.line.disconnected(reason, self.now)

    def _serve(self, frame: bytes) -> None:
        if self._is_serial:
            transaction, number, pdu = 0, frame[0], frame[1:-2]
        else:
            request = split(bytearray(frame), 0, len(frame))
            assert request is not None
            transaction, number, pdu = request.transaction, request.unit, request.pdu
        self.sent.append((self.now, number, pdu))
        unit = self.units.get(number)
        answer = None if unit is None else unit.answer(pdu)
        if unit is not None and answer is not None:
            data = bytes((number,)) + answer
            data = data + pdus.crc(data) if self._is_serial else encode(transaction, number, answer)
            heapq.heappush(self._coming, (self.now + unit.delay, next(self._number), data))


def polls(period: float = 0.02, *wanted: WantedItem) -> tuple[PollClass, ...]:
    """One poll class, of two registers unless something else is wanted."""
    items = wanted or (WantedItem(Area.HOLDING, 0, 2),)
    return plan_classes(items, [period] * len(items))


def make_world(
    settings: dict[int, StationSettings], line: LineSettings | None = None
) -> tuple[World, dict[int, Station], dict[int, Heard], dict[int, Unit]]:
    """A world with a unit for each number, all well."""
    heard = {number: Heard() for number in settings}
    stations = {number: Station(own, heard[number]) for number, own in settings.items()}
    units = {number: Unit() for number in settings}
    world = World(Line(line or LineSettings(), stations.values()), units)
    return world, stations, heard, units
