"""The NMT slave: states, commands, boot-up, and which service may run in which state (CiA 301, 7.2.8 and 7.3.2)."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum, IntEnum

from gatewayd.canopen.cob_ids import Function
from gatewayd.canopen.frame import Frame, Priority, Send

UNCONFIGURED = 255
"""Node-ID of a node that has none yet: LSS alone is active (CiA 305)."""


class NmtState(IntEnum):
    """The numbers are those of the heartbeat."""

    INITIALISING = 0
    STOPPED = 4
    OPERATIONAL = 5
    PRE_OPERATIONAL = 127


class NmtCommand(IntEnum):
    """Command specifiers of the NMT frame."""

    START = 1
    STOP = 2
    ENTER_PRE_OPERATIONAL = 128
    RESET_NODE = 129
    RESET_COMMUNICATION = 130


_RUNNING = (NmtState.STOPPED, NmtState.OPERATIONAL, NmtState.PRE_OPERATIONAL)
_TARGETS = {
    NmtCommand.START: NmtState.OPERATIONAL,
    NmtCommand.STOP: NmtState.STOPPED,
    NmtCommand.ENTER_PRE_OPERATIONAL: NmtState.PRE_OPERATIONAL,
    NmtCommand.RESET_NODE: NmtState.INITIALISING,
    NmtCommand.RESET_COMMUNICATION: NmtState.INITIALISING,
}
TRANSITIONS: dict[tuple[NmtState, NmtCommand], NmtState] = {
    (state, command): target for state in _RUNNING for command, target in _TARGETS.items()
}
"""What a command does. An initialising node hears none, and leaves the state by itself with its boot-up."""


class Service(Enum):
    """What NMT switches on and off."""

    PDO = "PDO"
    SDO = "SDO"
    SYNC = "SYNC"
    TIME = "TIME"
    EMCY = "EMCY"
    NODE_CONTROL = "NMT commands"
    ERROR_CONTROL = "heartbeat and guarding, produced and consumed"
    LSS = "LSS"


_ALWAYS = frozenset({Service.NODE_CONTROL, Service.ERROR_CONTROL})
_CONFIGURING = _ALWAYS | {Service.SDO, Service.SYNC, Service.TIME, Service.EMCY}
ALLOWED: dict[NmtState, frozenset[Service]] = {
    NmtState.INITIALISING: frozenset({Service.LSS}),
    NmtState.STOPPED: _ALWAYS | {Service.LSS},
    NmtState.PRE_OPERATIONAL: _CONFIGURING | {Service.LSS},
    NmtState.OPERATIONAL: _CONFIGURING | {Service.PDO},
}
"""CiA 301, table 38; LSS after CiA 305: a node keeps INITIALISING only while it waits for a node-ID."""


class NmtSlave:
    """The state of one node.

    `node` gives the present node-ID. `changed(old, new, now)` is called after each change of state, `reset(command,
    now)` while the node initialises, before its boot-up: it gives the parameters their power-on values.
    """

    def __init__(
        self,
        send: Send,
        node: Callable[[], int],
        changed: Callable[[NmtState, NmtState, float], None],
        reset: Callable[[NmtCommand, float], None],
        *,
        autostart: bool = False,
    ) -> None:
        self.state = NmtState.INITIALISING
        self._send = send
        self._node = node
        self._changed = changed
        self._reset = reset
        self._autostart = autostart
        self.ignored: Callable[[bytes], None] = lambda _data: None
        """Called with what was sent to this node and is no command."""

    def allows(self, service: Service) -> bool:
        """Whether the service runs in the present state."""
        return service in ALLOWED[self.state]

    def report(self, toggle: int = 0) -> Frame:
        """The state as boot-up, heartbeat and guarding report it; guarding adds a toggle bit."""
        return Frame(Function.ERROR_CONTROL + self._node(), bytes([self.state | toggle]))

    def receive(self, frame: Frame, now: float) -> None:
        """A frame with COB-ID 0. Wrong lengths, other nodes' commands and unknown commands are ignored."""
        data = frame.data
        if frame.remote or (len(data) == 2 and data[1] not in (0, self._node())):
            return
        if len(data) == 2 and data[0] in _TARGETS:
            self.command(NmtCommand(data[0]), now)
        else:
            self.ignored(data)

    def command(self, command: NmtCommand, now: float) -> None:
        """Carry out a command, of the master or of the error behaviour (1029h)."""
        target = TRANSITIONS.get((self.state, command))
        if target is None:
            return
        self._enter(target, now)
        if target is NmtState.INITIALISING:
            self._reset(command, now)
            self.boot(now)

    def boot(self, now: float) -> None:
        """Leave INITIALISING: boot-up frame, PRE-OPERATIONAL, and OPERATIONAL with `autostart`.

        A node without node-ID stays, silent, until LSS has given it one and calls again.
        """
        if self.state is not NmtState.INITIALISING or self._node() == UNCONFIGURED:
            return
        self._send(self.report(), Priority.EVENT)
        self._enter(NmtState.PRE_OPERATIONAL, now)
        if self._autostart:
            self._enter(NmtState.OPERATIONAL, now)

    def resume(self, state: NmtState, now: float) -> None:
        """Be in a state without a boot-up, in place of a node that was in it."""
        self._enter(state, now)

    def _enter(self, state: NmtState, now: float) -> None:
        old, self.state = self.state, state
        if old is not state:
            self._changed(old, state, now)
