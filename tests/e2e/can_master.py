"""A CANopen master as a program of its own: python-canopen, told what to do line by line.

Arguments: interface and channel of python-can, the data sheet, the node-ID of the gateway. Each line on standard input
is a JSON list of a command and its arguments, and has one line of JSON as its answer. Objects are called by
index and sub-index, "2010:1".
"""

from __future__ import annotations

import contextlib
import json
import sys
import time
from collections.abc import Callable
from typing import Any, cast

import canopen

MASTER = 1
"""Node-ID in its heartbeat."""
BEAT = 0.05
"""Seconds between its heartbeats."""
PATIENCE = 10.0


class Master:
    """One network with one node."""

    def __init__(self, interface: str, channel: str, sheet: str, node: int) -> None:
        self._bus = {"interface": interface, "channel": channel}
        if interface == "slcan":
            self._bus |= {"sleep_after_open": 0, "bitrate": 1_000_000}  # type: ignore[dict-item]
        self._sheet = canopen.import_od(sheet, node)
        self._id = node
        self._boots = 0
        self._states: list[int] = []
        self._last = 0.0
        self._beat: Any = None
        self._watched: list[tuple[float, Any]] = []
        self.connect()

    # -- commands ------------------------------------------------------------------------------------------------

    def connect(self) -> None:
        """Go onto the bus and send a heartbeat."""
        self._network: Any = canopen.Network()
        self._network.NOTIFIER_CYCLE = 0.05
        self._network.connect(**self._bus)
        self._node = cast("Any", self._network.add_node(canopen.RemoteNode(self._id, self._sheet)))
        self._node.sdo.RESPONSE_TIMEOUT = PATIENCE
        self._node.tpdo.read(from_od=True)
        self._node.rpdo.read(from_od=True)
        self._network.subscribe(0x700 + self._id, self._hear)
        self.beat(True)

    def disconnect(self) -> None:
        """Leave the bus, whatever state it is in."""
        with contextlib.suppress(Exception):
            self.beat(False)
        self._beat = None
        with contextlib.suppress(Exception):
            self._network.notifier.stop(1)
        with contextlib.suppress(Exception):
            self._network.bus.shutdown()

    def beat(self, on: bool) -> None:
        """Tell heartbeats, or none."""
        if self._beat is not None:
            self._beat.stop()
            self._beat = None
        if on:
            self._beat = self._network.send_periodic(0x700 + MASTER, b"\5", BEAT)

    def nmt(self, name: str) -> None:
        """Command a state."""
        self._node.nmt.state = name

    def heard(self) -> dict[str, float]:
        """What the node's error control said: last state, seconds since then, boot-ups."""
        state = self._states[-1] if self._states else -1
        return {"state": state, "age": time.monotonic() - self._last, "boots": self._boots}

    def outputs(self) -> dict[str, Any]:
        """All mapped objects of TPDOs as they were received last, and the number of TPDOs that were."""
        maps = list(self._node.tpdo.values())
        found = {self._key(one): one.raw for pdo in maps for one in pdo.map}
        return {"received": sum(pdo.timestamp is not None for pdo in maps), "values": found}

    def forget(self) -> None:
        """Forget all TPDOs."""
        for pdo in self._node.tpdo.values():
            pdo.timestamp = None

    def inputs(self, values: dict[str, Any]) -> int:
        """Set mapped objects and send their RPDOs; how many those were."""
        touched = []
        for pdo in self._node.rpdo.values():
            ours = [one for one in pdo.map if self._key(one) in values]
            for one in ours:
                one.raw = values[self._key(one)]
            if ours:
                touched.append(pdo)
        for pdo in touched:
            pdo.transmit()
        return len(touched)

    def repeat(self, values: dict[str, Any], period: float) -> int:
        """Set mapped objects and send their RPDOs every `period` seconds from now on; how many those are."""
        chosen = []
        for pdo in self._node.rpdo.values():
            ours = [one for one in pdo.map if self._key(one) in values]
            for one in ours:
                one.raw = values[self._key(one)]
            if ours:
                chosen.append(pdo)
        for pdo in chosen:
            pdo.start(period)
        return len(chosen)

    def stop_repeating(self) -> None:
        """End every `repeat`."""
        for pdo in self._node.rpdo.values():
            pdo.stop()

    def watch(self, key: str) -> None:
        """Keep from now on when which value of a mapped object came."""

        def keep(pdo: Any) -> None:
            self._watched += [(time.monotonic(), one.raw) for one in pdo.map if self._key(one) == key]

        for pdo in self._node.tpdo.values():
            if any(self._key(one) == key for one in pdo.map):
                pdo.add_callback(keep)

    def watched(self) -> list[tuple[float, Any]]:
        """Monotonic time and value of all that came since the last call."""
        found, self._watched = self._watched, []
        return found

    def read(self, index: int, subindex: int) -> Any:
        """Upload: the value; or the abort code as text."""
        return self._sdo(lambda: self._entry(index, subindex).raw)

    def write(self, index: int, subindex: int, value: Any) -> Any:
        """Download: null; or the abort code as text."""

        def write() -> None:
            self._entry(index, subindex).raw = value

        return self._sdo(write)

    def emergencies(self) -> list[tuple[int, int, str]]:
        """Code, error register and data of all that came since the last call."""
        log, self._node.emcy.log = self._node.emcy.log, []
        return [(one.code, one.register, one.data.hex()) for one in log]

    def sync(self) -> None:
        self._network.sync.transmit()

    # -- inside --------------------------------------------------------------------------------------------------

    def _hear(self, _can_id: int, data: bytearray, _moment: float) -> None:
        self._states.append(data[0])
        self._last = time.monotonic()
        self._boots += data[0] == 0

    def _entry(self, index: int, subindex: int) -> Any:
        found = self._node.sdo[index]
        return found[subindex] if hasattr(found, "values") else found

    def _sdo(self, act: Callable[[], Any]) -> Any:
        try:
            return act()
        except canopen.SdoAbortedError as error:
            return f"{error.code:08X}"

    @staticmethod
    def _key(one: Any) -> str:
        return f"{one.index:x}:{one.subindex}"


def main() -> None:
    master = Master(sys.argv[1], sys.argv[2], sys.argv[3], int(sys.argv[4]))
    print("master", flush=True)
    for line in sys.stdin:
        command, *arguments = json.loads(line)
        print(json.dumps(getattr(master, command)(*arguments)), flush=True)


if __name__ == "__main__":
    main()
