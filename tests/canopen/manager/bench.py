"""A bus in simulated time: a manager, and devices made of this project's own SDO server and NMT slave."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from gatewayd.canopen.bus import BusState
from gatewayd.canopen.datatypes import CanType, Value
from gatewayd.canopen.dictionary import Access, Dictionary, Entry, Object, array, record, variable
from gatewayd.canopen.frame import Frame, Priority
from gatewayd.canopen.heartbeat import HeartbeatProducer
from gatewayd.canopen.manager.bus_manager import BusManager
from gatewayd.canopen.manager.emergency_text import EmergencyMessage
from gatewayd.canopen.manager.letters import BootError
from gatewayd.canopen.manager.node import ManagedNode, NodeObserver
from gatewayd.canopen.manager.plan import ManagedPdo, ManagerPlan, NodePlan, PdoObject
from gatewayd.canopen.nmt import NmtCommand, NmtSlave, Service
from gatewayd.canopen.sdo.server import SdoServer

VENDOR, PRODUCT, REVISION, SERIAL = 0x1F0, 0x401, 0x10002, 77
POSITION = PdoObject(0x6004, 0, 32, CanType.INTEGER32)
OUTPUT = PdoObject(0x6200, 1, 8, CanType.UNSIGNED8)
TPDO = ManagedPdo(1, True, 0x185, (POSITION,))
RPDO = ManagedPdo(1, False, 0x205, (OUTPUT,))


class Diary(NodeObserver):
    """Remembers what a device's manager reports."""

    def __init__(self) -> None:
        self.events: list[str] = []
        self.values: list[Value] = []
        self.read: list[Value] = []
        self.emergencies: list[EmergencyMessage] = []
        self.seen = 0

    def node_started(self, now: float) -> None:
        self.events.append("started")

    def node_seen(self, now: float) -> None:
        self.seen += 1

    def node_ended(self, reason: str, now: float) -> None:
        self.events.append(f"ended: {reason}")

    def boot_failed(self, letter: BootError, detail: str, now: float) -> None:
        self.events.append(f"{letter.value}: {detail}")

    def pdo_received(self, pdo: int, values: list[Value], now: float) -> None:
        self.values += values

    def object_read(self, index: int, subindex: int, value: Value, now: float) -> None:
        self.read.append(value)

    def object_unread(self, index: int, subindex: int, reason: str, now: float) -> None:
        self.events.append(f"unread {index:04X}:{subindex}: {reason}")

    def object_unwritten(self, index: int, subindex: int, reason: str, now: float) -> None:
        self.events.append(f"unwritten {index:04X}:{subindex}: {reason}")

    def emergency_received(self, message: EmergencyMessage, now: float) -> None:
        self.emergencies.append(message)


class Device:
    """A node with an SDO server, NMT states and a heartbeat; `silent`: nothing of it is heard, and it hears nothing."""

    def __init__(self, bench: Bench, node: int = 5, **changes: Any) -> None:
        self.node = node
        self.silent = False
        self.written: list[tuple[int, int]] = []
        """Objects in the order in which they were written."""
        self.outputs: list[bytes] = []
        """RPDOs that it took."""
        self.stores = True
        """It keeps what was written over a reset."""
        self.held: list[Frame] | None = None
        """Answers that it has not given yet, while it is slow."""
        self.dies_of_reset = False
        self._bench = bench
        self._numbers = {
            "device_type": 0x20196,
            "vendor": VENDOR,
            "product": PRODUCT,
            "revision": REVISION,
            "serial": SERIAL,
        } | changes
        self.nmt = NmtSlave(self._send, lambda: node, lambda *_: None, lambda *_: self._reset())
        self.heartbeat = HeartbeatProducer(self._send, self.nmt, lambda _now: True, 0)
        self.entries: dict[tuple[int, int], Entry] = {}
        self._reset()

    @property
    def objects(self) -> list[Object]:
        numbers = self._numbers
        mapping = {
            0x1A00: TPDO.objects[0].entry,
            0x1600: RPDO.objects[0].entry,
        }
        made = [
            variable(0x1000, Entry.constant(0, "Device type", numbers["device_type"])),
            record(
                0x1018,
                "Identity",
                [
                    Entry.constant(place, name, numbers[name])
                    for place, name in enumerate(("vendor", "product", "revision", "serial"), 1)
                ],
            ),
            variable(0x100A, Entry(0, "Software", CanType.VISIBLE_STRING, Access.CONST, b"V1.23 beta")),
            array(0x1020, "Date", [Entry.parameter(n, f"d{n}", CanType.UNSIGNED32, 0) for n in (1, 2)]),
            array(0x1010, "Store", [Entry(1, "all", CanType.UNSIGNED32, Access.RW, bytes(4))]),
            variable(0x6004, Entry(0, "Position", CanType.INTEGER32, Access.RO, b"\7\0\0\0")),
            array(0x6200, "Outputs", [Entry(1, "o1", CanType.UNSIGNED8, Access.RW, b"\x2a")]),
            variable(0x2000, Entry(0, "Preset", CanType.UNSIGNED16, Access.RW, bytes(2))),
            *self.heartbeat.objects(),
        ]
        for parameter, base in ((0x1400, 0x200), (0x1800, 0x180)):
            communication = [
                Entry.parameter(1, "COB-ID", CanType.UNSIGNED32, base + self.node),
                Entry.parameter(2, "type", CanType.UNSIGNED8, 254),
                Entry.parameter(3, "inhibit", CanType.UNSIGNED16, 0),
                Entry.parameter(5, "event", CanType.UNSIGNED16, 0),
            ]
            made.append(record(parameter, "PDO", communication))
            map_index = parameter + 0x200
            count = Entry(0, "count", CanType.UNSIGNED8, Access.RW, b"\1")
            places = [
                Entry.parameter(n, f"m{n}", CanType.UNSIGNED32, mapping[map_index] if n == 1 else 0)
                for n in range(1, 5)
            ]
            made.append(record(map_index, "mapping", [count, *places]))
        return made

    def _reset(self) -> None:
        kept = {place: entry.value for place, entry in self.entries.items()} if self.stores else {}
        dictionary = Dictionary(self.objects)
        self.entries = {(item.index, entry.subindex): entry for item in dictionary for entry in item.entries}
        for place, value in kept.items():
            self.entries[place].value = value
        self.server = SdoServer(_Noting(dictionary, self.written))  # type: ignore[arg-type]

    def boot(self) -> None:
        """Power on."""
        self.nmt.boot(self._bench.now)

    def reboot(self) -> None:
        """Power off and on."""
        self.nmt.resume(self.nmt.state.INITIALISING, self._bench.now)
        self._reset()
        self.boot()

    def say(self, can_id: int, data: bytes) -> None:
        """Send a frame."""
        self._send(Frame(can_id, data), Priority.EVENT)

    def answer(self) -> None:
        """Give the answers that were held back."""
        held, self.held = self.held or [], None
        for frame in held:
            self._bench.put(frame, self)

    def receive(self, frame: Frame, now: float) -> None:
        if frame.can_id == 0:
            self.silent = self.dies_of_reset and frame.data[0] == NmtCommand.RESET_COMMUNICATION
            self.nmt.receive(frame, now)
        elif frame.can_id == 0x600 + self.node and self.nmt.allows(Service.SDO):
            answers = self.server.receive(frame.data, now)
            self.tick(now)  # a heartbeat whose time was written comes first
            for answer in answers:
                made = Frame(0x580 + self.node, answer)
                if self.held is not None:
                    self.held.append(made)
                else:
                    self._bench.put(made, self)
        elif frame.can_id == RPDO.cob_id - 5 + self.node and self.nmt.allows(Service.PDO):
            self.outputs.append(frame.data)

    def tick(self, now: float) -> None:
        self.heartbeat.tick(now)

    def _send(self, frame: Frame, _priority: Priority) -> bool:
        self._bench.put(frame, self)
        return True


class _Noting:
    """A dictionary that notes what is written."""

    def __init__(self, dictionary: Dictionary, written: list[tuple[int, int]]) -> None:
        self._dictionary, self._written = dictionary, written
        self.entry, self.read = dictionary.entry, dictionary.read

    def write(self, index: int, subindex: int, data: bytes) -> Any:
        self._written.append((index, subindex))
        return self._dictionary.write(index, subindex, data)


class Bench:
    """Frames in their order, time in steps of a millisecond."""

    def __init__(self, plan: ManagerPlan | None = None) -> None:
        self.now = 100.0
        self.sent: list[Frame] = []
        """By the manager."""
        self.devices: list[Device] = []
        self.lives = True
        self._frames: list[tuple[Frame, Device | None]] = []
        self.manager = BusManager(
            plan or ManagerPlan("virtual", "bench", 500_000),
            self._send,
            lambda _now: self.lives,
            lambda: None,
        )

    def device(self, node: int = 5, **changes: Any) -> Device:
        """A device that is switched on."""
        made = Device(self, node, **changes)
        self.devices.append(made)
        made.boot()
        return made

    def attach(self, **changes: Any) -> tuple[ManagedNode, Diary]:
        """A device in the manager's care; by default with a heartbeat of 100 ms that is lost after 300."""
        diary = Diary()
        settings: dict[str, Any] = {"node": 5, "heartbeat": 0.3, "producer": 100, "pdos": (TPDO, RPDO)}
        node = self.manager.attach(NodePlan(**settings | changes), diary, self.now)
        return node, diary

    def up(self) -> None:
        """The bus carries frames."""
        self.manager.bus_changed(BusState.ACTIVE, self.now)

    def put(self, frame: Frame, sender: Device | None) -> None:
        if not self.manager.bus.carries:
            return
        if sender is None or not sender.silent:
            self._frames.append((frame, sender))

    def _send(self, frame: Frame, _priority: Priority) -> bool:
        self.sent.append(frame)
        self.put(frame, None)
        return True

    def settle(self) -> None:
        """Carry all frames."""
        while self._frames:
            frame, sender = self._frames.pop(0)
            if sender is not None:
                self.manager.receive(frame, self.now)
            for device in self.devices:
                if device is not sender and not device.silent:
                    device.receive(frame, self.now)

    def run(self, seconds: float, until: Callable[[], object] = lambda: False) -> None:
        """Let time pass, or less if `until` holds before."""
        end = self.now + seconds
        self.settle()
        while self.now < end and not until():
            for device in self.devices:
                device.tick(self.now)
            # A deadline that has passed and stays would be a loop that never sleeps.
            if self.manager.next_deadline() <= self.now:
                self.manager.tick(self.now)
                assert self.manager.next_deadline() > self.now or self._frames, "a deadline does not go away"
            self.settle()
            self.now += 0.001

    def commands(self) -> list[tuple[int, int]]:
        """NMT commands that the manager sent."""
        return [(frame.data[0], frame.data[1]) for frame in self.sent if frame.can_id == 0]


NEVER = math.inf
