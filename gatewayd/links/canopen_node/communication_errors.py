"""What is wrong with the communication of a node, as errors (EMCY), and how the node reacts (1029h).

What happens to the node, and what follows:

| event | writers of the cell | NMT (1029h = 0 / 1 / 2) | EMCY |
|---|---|---|---|
| RPDO in OPERATIONAL, SDO request | the writer is alive | | |
| heartbeat of a node of 1016h ends | its writer is lost, and refused until it is back \
| PRE-OPERATIONAL / as it is / STOPPED | 8130h until it is back |
| heartbeat that the mapping promises ends, or does not come after the first write or lock request \
| its writer is lost, and refused until it is back | as it is | |
| node whose heartbeat is promised boots | its writer is lost | as it is | |
| guarding is missing | | PRE-OPERATIONAL / as it is / STOPPED | 8130h until it is back |
| RPDO deadline passes | the RPDO writer is lost | as it is | 8250h until it is received |
| OPERATIONAL left | the RPDO writer is lost | | |
| SDO no longer allowed (STOPPED, reset) | the SDO writer is lost | | |
| bus off, down or absent | all are lost | PRE-OPERATIONAL / as it is / STOPPED | none goes out |
| bus is back | | "reset communication" if its loss had ended OPERATIONAL / as it is / as it is | 8140h, 0000h after \
bus-off |
| controller passive | | as it is | 8120h until it is no more |
| another node has our node-ID | | as it is | 8150h until it was not seen for `DOUBLED_TIME` |
| received frames lost | | as it is | 8110h until none was lost for `OVERRUN_TIME` |
| robot lost / stale / holds something else / registers unavailable | | as it is | FF10h / FF11h / FF12h / FF13h until \
that has not been so for `QUIET` |
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from gatewayd.canopen.bus import BusState
from gatewayd.canopen.emergency import Emergency, ErrorCode
from gatewayd.canopen.identity import ErrorBehaviour
from gatewayd.canopen.nmt import NmtCommand, NmtSlave, NmtState
from gatewayd.links.canopen_node.observer import NodeCounters
from gatewayd.links.canopen_node.pdo.receive import Fault
from gatewayd.links.canopen_node.pdo.transmit import TransmitEngine

DOUBLED_TIME: Final = 60.0
"""Seconds after the last sign of another node with our node-ID until it counts as gone: heartbeats may be rare."""
OVERRUN_TIME: Final = 1.0
"""Seconds without a lost frame after which the overrun is over."""


class CommunicationErrors:
    """Keeps them in `emergency`. `lose_node` and `lose_rpdo` say whose writers are lost by it, and why."""

    def __init__(
        self,
        emergency: Emergency,
        nmt: NmtSlave,
        transmit: TransmitEngine,
        counters: NodeCounters,
        *,
        lose_node: Callable[[str, int, float], None],
        lose_rpdo: Callable[[int, str, float], None],
        behaviour: int = 0,
    ) -> None:
        self.behaviour = ErrorBehaviour(behaviour)
        self._emergency = emergency
        self._nmt = nmt
        self._transmit = transmit
        self._counters = counters
        self._lose_node = lose_node
        self._lose_rpdo = lose_rpdo
        self._fell = self._was_off = False
        self._overrun_until = math.inf
        self._doubled_until = math.inf

    # -- peers ---------------------------------------------------------------------------------------------------

    def heartbeat_lost(self, node: int, now: float) -> None:
        """A node of 1016h is no longer heard."""
        self._emergency.raise_error(ErrorCode.HEARTBEAT, now, bytes([node]), instance=node)
        self._lose_node("no heartbeat of node {}", node, now)
        self._communication_error(now)

    def heartbeat_back(self, node: int, now: float) -> None:
        """It is heard again."""
        self._emergency.clear(ErrorCode.HEARTBEAT, now, instance=node)

    def guarding_lost(self, now: float) -> None:
        """The guarding master is no longer heard."""
        self._emergency.raise_error(ErrorCode.HEARTBEAT, now)
        self._communication_error(now)

    def sync_length(self, length: int, now: float) -> None:
        """A SYNC came with a wrong number of bytes."""
        self._emergency.raise_error(ErrorCode.SYNC_LENGTH, now, bytes([length]))

    def fault_raised(self, fault: Fault, number: int, now: float) -> None:
        """Something is wrong with an RPDO."""
        self._emergency.raise_error(fault.value, now, number.to_bytes(2, "little"), instance=number)
        if fault is Fault.TIMEOUT:
            self._lose_rpdo(number, f"RPDO {number} is missing", now)

    def fault_cleared(self, fault: Fault, number: int, now: float) -> None:
        """It is right again."""
        self._emergency.clear(fault.value, now, instance=number)

    # -- bus -----------------------------------------------------------------------------------------------------

    def bus_seen(self, state: BusState, now: float) -> None:
        """The bus is in this state now, after `bus_lost` or `bus_back`."""
        self._was_off = self._was_off or state is BusState.BUS_OFF
        self._emergency.judge(ErrorCode.PASSIVE, state is BusState.PASSIVE, now)

    def bus_lost(self, now: float) -> None:
        """No frame goes through any more."""
        was_operational = self._nmt.state is NmtState.OPERATIONAL
        self._communication_error(now)
        self._fell = was_operational and self._nmt.state is NmtState.PRE_OPERATIONAL

    def bus_back(self, now: float) -> None:
        """Frames go through again."""
        fell, self._fell = self._fell, False
        was_off, self._was_off = self._was_off, False
        if self._nmt.state is NmtState.INITIALISING:
            self._nmt.boot(now)
        elif fell:
            self._nmt.command(NmtCommand.RESET_COMMUNICATION, now)
        elif self._nmt.state is NmtState.OPERATIONAL:
            # What was sent meanwhile has reached nobody: every TPDO starts anew.
            self._transmit.nmt(False, now)
            self._transmit.nmt(True, now)
        if was_off:
            self._emergency.raise_error(ErrorCode.BUS_OFF_RECOVERED, now)
            self._emergency.clear(ErrorCode.BUS_OFF_RECOVERED, now)

    def frames_lost(self, count: int, now: float) -> None:
        """So many received frames found no room in a buffer."""
        self._counters.overruns += count
        self._overrun_until = now + OVERRUN_TIME
        self._emergency.raise_error(ErrorCode.OVERRUN, now)

    def doubled(self, now: float) -> bool:
        """Somebody else sends with the COB-ID of our heartbeat; returns whether that is new."""
        news = not self.is_doubled
        self._doubled_until = now + DOUBLED_TIME
        self._emergency.raise_error(ErrorCode.COB_ID_COLLISION, now)
        return news

    @property
    def is_doubled(self) -> bool:
        """Whether another node has our node-ID."""
        return self._doubled_until < math.inf

    # -- time ----------------------------------------------------------------------------------------------------

    def tick(self, now: float) -> None:
        """End an overrun after which nothing was lost, and what was not seen again of another node."""
        if now >= self._doubled_until:
            self._doubled_until = math.inf
            self._emergency.clear(ErrorCode.COB_ID_COLLISION, now)
        if now >= self._overrun_until:
            self._overrun_until = math.inf
            self._emergency.clear(ErrorCode.OVERRUN, now)

    def next_deadline(self, now: float) -> float:
        """When one of them ends; infinity without any."""
        return min(self._overrun_until, self._doubled_until)

    def resume(self, former: CommunicationErrors) -> None:
        """Take over what the bus has done to another node."""
        self._counters = former._counters
        self._fell, self._was_off = former._fell, former._was_off
        self._overrun_until, self._doubled_until = former._overrun_until, former._doubled_until

    def _communication_error(self, now: float) -> None:
        self._counters.communication_errors += 1
        reaction = self.behaviour.reaction(self._nmt.state)
        if reaction is not None:
            self._nmt.command(reaction, now)
