"""The LSS slave: a master finds the node by its identity and gives it a node-ID and a bit rate (CiA 305).

A new node-ID is pending until "reset communication"; a node without one leaves LSS by the switch to waiting state
and boots. This node never sets the bit rate of a CAN interface by itself: it accepts the rates that its link declares
and asks the link to switch.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum, IntEnum
from typing import ClassVar

from gatewayd.canopen.cob_ids import Function
from gatewayd.canopen.frame import Frame, Priority, Send
from gatewayd.canopen.identity import Identity
from gatewayd.canopen.nmt import UNCONFIGURED

BIT_RATES = (1_000_000, 800_000, 500_000, 250_000, 125_000, None, 50_000, 20_000, 10_000)
"""Bits per second by index of the CiA bit timing table; index 5 is reserved."""
_CONFIRM = 0x80
"""Bit check of a fastscan that starts anew."""


class LssState(Enum):
    """CiA 305, figure 5."""

    WAITING = "waiting"
    CONFIGURATION = "configuration"


class Command(IntEnum):
    """LSS command specifiers."""

    SWITCH_GLOBAL = 0x04
    CONFIGURE_NODE = 0x11
    CONFIGURE_BIT_TIMING = 0x13
    ACTIVATE_BIT_TIMING = 0x15
    STORE = 0x17
    SELECT_VENDOR = 0x40
    SELECT_PRODUCT = 0x41
    SELECT_REVISION = 0x42
    SELECT_SERIAL = 0x43
    SELECTED = 0x44
    IDENTIFY_VENDOR = 0x46
    IDENTIFY_PRODUCT = 0x47
    IDENTIFY_REVISION_LOW = 0x48
    IDENTIFY_REVISION_HIGH = 0x49
    IDENTIFY_SERIAL_LOW = 0x4A
    IDENTIFY_SERIAL_HIGH = 0x4B
    IDENTIFY_NON_CONFIGURED = 0x4C
    IDENTIFIED = 0x4F
    NON_CONFIGURED = 0x50
    FASTSCAN = 0x51
    INQUIRE_VENDOR = 0x5A
    INQUIRE_PRODUCT = 0x5B
    INQUIRE_REVISION = 0x5C
    INQUIRE_SERIAL = 0x5D
    INQUIRE_NODE = 0x5E


Handler = Callable[["LssSlave", bytes, float], None]


class LssSlave:
    """LSS of one node.

    `node` is the node-ID to begin with, 255 for none. `bit_rates`: what the link can switch to, the present rate
    included. `configured(now)`: a node without node-ID has got one. `store(node, bit_rate, answer)`: keep both, and
    call `answer` with whether that worked, now or later. `activate(bit_rate, delay, now)`: be silent for `delay`
    seconds, switch, be silent again.
    """

    def __init__(
        self,
        send: Send,
        identity: Identity,
        node: int,
        bit_rate: int,
        *,
        bit_rates: frozenset[int],
        configured: Callable[[float], None],
        store: Callable[[int, int, Callable[[bool], None]], None],
        activate: Callable[[int, float, float], None],
    ) -> None:
        self.pending_node = node
        self.pending_bit_rate = bit_rate
        self._send = send
        self._address = (identity.vendor, identity.product, identity.revision, identity.serial)
        self._bit_rates = bit_rates
        self._configured = configured
        self._store = store
        self._activate = activate
        self.restart()

    def restart(self) -> None:
        """NMT reset: the pending node-ID is in force, and LSS waits."""
        self.node = self.pending_node
        """Node-ID in force."""
        self.state = LssState.WAITING
        self._select: dict[int, int] = {}
        self._identify: dict[int, int] = {}
        self._position = 0

    def receive(self, frame: Frame, now: float) -> None:
        """A frame with COB-ID 7E5h. Anything that is no request for this state is ignored, as CiA 305 demands."""
        if frame.remote or len(frame.data) != 8:
            return
        handler = self.IN_ANY_STATE.get(frame.data[0])
        if handler is None and self.state is LssState.CONFIGURATION:
            handler = self.CONFIGURING.get(frame.data[0])
        if handler is not None:
            handler(self, frame.data, now)

    def _switch_global(self, data: bytes, now: float) -> None:
        if data[1] == 0:
            self._wait(now)
        elif data[1] == 1:
            self.state = LssState.CONFIGURATION

    def _wait(self, now: float) -> None:
        was, self.state = self.state, LssState.WAITING
        if was is LssState.CONFIGURATION and self.node == UNCONFIGURED != self.pending_node:
            self.node = self.pending_node
            self._configured(now)

    def _switch_selective(self, data: bytes, now: float) -> None:
        """Four frames in order; the last one decides."""
        if self.state is LssState.CONFIGURATION:
            return
        self._collect(self._select, data, Command.SELECT_VENDOR)
        if data[0] == Command.SELECT_SERIAL and tuple(self._select.values()) == self._address:
            self.state = LssState.CONFIGURATION
            self._answer(bytes([Command.SELECTED]))

    def _identify_remote(self, data: bytes, now: float) -> None:
        """Six frames in order: vendor, product, and ranges of revision and serial number."""
        self._collect(self._identify, data, Command.IDENTIFY_VENDOR)
        if data[0] != Command.IDENTIFY_SERIAL_HIGH or len(self._identify) != 6:
            return
        vendor, product, revision_low, revision_high, serial_low, serial_high = self._identify.values()
        if (
            (vendor, product) == self._address[:2]
            and revision_low <= self._address[2] <= revision_high
            and serial_low <= self._address[3] <= serial_high
        ):
            self._answer(bytes([Command.IDENTIFIED]))

    def _collect(self, collected: dict[int, int], data: bytes, first: int) -> None:
        """Add one part of an address; a part out of order starts over."""
        if data[0] != first + len(collected):
            collected.clear()
        if data[0] == first + len(collected):
            collected[data[0]] = int.from_bytes(data[1:5], "little")

    def _identify_non_configured(self, data: bytes, now: float) -> None:
        if self.node == self.pending_node == UNCONFIGURED:
            self._answer(bytes([Command.NON_CONFIGURED]))

    def _fastscan(self, data: bytes, now: float) -> None:
        """One step of the search, bit by bit, that only nodes without node-ID take part in."""
        number = int.from_bytes(data[1:5], "little")
        bit, position, following = data[5:8]
        if not self.node == self.pending_node == UNCONFIGURED or self.state is not LssState.WAITING:
            return
        if bit == _CONFIRM:
            self._position = 0
            self._answer(bytes([Command.IDENTIFIED]))
            return
        if bit > 31 or position > 3 or following > 3 or position != self._position:
            return
        if self._address[position] >> bit != number >> bit:
            return
        self._position = following
        if bit == 0 and following < position:
            self.state = LssState.CONFIGURATION
        self._answer(bytes([Command.IDENTIFIED]))

    def _configure_node(self, data: bytes, now: float) -> None:
        valid = 1 <= data[1] <= 127 or data[1] == UNCONFIGURED
        if valid:
            self.pending_node = data[1]
        self._answer(bytes([Command.CONFIGURE_NODE, 0 if valid else 1]))

    def _configure_bit_timing(self, data: bytes, now: float) -> None:
        """Table 0 is that of CiA; only rates that the link declared are supported."""
        rate = BIT_RATES[data[2]] if data[1] == 0 and data[2] < len(BIT_RATES) else None
        supported = rate is not None and rate in self._bit_rates
        if rate is not None and supported:
            self.pending_bit_rate = rate
        self._answer(bytes([Command.CONFIGURE_BIT_TIMING, 0 if supported else 1]))

    def _activate_bit_timing(self, data: bytes, now: float) -> None:
        self._activate(self.pending_bit_rate, int.from_bytes(data[1:3], "little") / 1000, now)

    def _store_configuration(self, data: bytes, now: float) -> None:
        self._store(
            self.pending_node,
            self.pending_bit_rate,
            lambda stored: self._answer(bytes([Command.STORE, 0 if stored else 2])),
        )

    def _inquire_address(self, data: bytes, now: float) -> None:
        part = self._address[data[0] - Command.INQUIRE_VENDOR]
        self._answer(bytes([data[0]]) + part.to_bytes(4, "little"))

    def _inquire_node(self, data: bytes, now: float) -> None:
        self._answer(bytes([Command.INQUIRE_NODE, self.node]))

    def _answer(self, data: bytes) -> None:
        self._send(Frame(Function.LSS_RESPONSE, data.ljust(8, b"\0")), Priority.ORDERED)

    IN_ANY_STATE: ClassVar[dict[int, Handler]] = {
        Command.SWITCH_GLOBAL: _switch_global,
        **dict.fromkeys(range(Command.SELECT_VENDOR, Command.SELECT_SERIAL + 1), _switch_selective),
        **dict.fromkeys(range(Command.IDENTIFY_VENDOR, Command.IDENTIFY_SERIAL_HIGH + 1), _identify_remote),
        Command.IDENTIFY_NON_CONFIGURED: _identify_non_configured,
        Command.FASTSCAN: _fastscan,
    }
    CONFIGURING: ClassVar[dict[int, Handler]] = {
        Command.CONFIGURE_NODE: _configure_node,
        Command.CONFIGURE_BIT_TIMING: _configure_bit_timing,
        Command.ACTIVATE_BIT_TIMING: _activate_bit_timing,
        Command.STORE: _store_configuration,
        **dict.fromkeys(range(Command.INQUIRE_VENDOR, Command.INQUIRE_SERIAL + 1), _inquire_address),
        Command.INQUIRE_NODE: _inquire_node,
    }
    """What is served in the state CONFIGURATION alone."""
