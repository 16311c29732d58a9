"""An edge node of Sparkplug B 3.0 as a state machine (specification 5.4 to 5.7, 5.11, 5.16, 5.17).

Values that cannot be sent are kept, and sent as historical afterwards, after those of now and at a bounded rate. What
the connection does not take is not lost: births and deaths are tried again, and a sequence number is used up when its
message is on its way.

What the specification leaves open:
- A rebirth that is asked for within `rebirth_pause` after a birth happens when the pause is over, once for all who
  asked; data goes on until then. A sender of NCMD could otherwise keep a gateway busy with births.
- An offline primary host makes a node leave that has been born. One that has not waits where it is: with one server,
  leaving would mean to connect again for the same answer. Where there are several, `leaves_waiting` lets it walk.
- NDEATH is not published before a birth: births are the first messages (tck-id-principles-birth-certificates-order).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

from gatewayd.sparkplug.actions import CommandReceived, CommandRefused, EdgeNodeUser, SparkplugMessage
from gatewayd.sparkplug.commands import read_command
from gatewayd.sparkplug.datatypes import encode_value
from gatewayd.sparkplug.declarations import DeviceDeclaration, MetricDeclaration, MetricValue
from gatewayd.sparkplug.history import HistoryLimits, StoredValue, ValueHistory
from gatewayd.sparkplug.messages import SEQUENCES, MessageWriter
from gatewayd.sparkplug.primary_host import PrimaryHost
from gatewayd.sparkplug.roster import Roster, RosterDevice
from gatewayd.sparkplug.states import TRANSITIONS, EdgeNodeSignal, EdgeNodeState
from gatewayd.sparkplug.topics import MessageType, SparkplugTopic, name_fault, parse_topic
from gatewayd.sparkplug.wire import PayloadError

OFFLINE, WAITING, BEARING, ONLINE = EdgeNodeState


@dataclass(frozen=True, slots=True)
class EdgeNodeSettings:
    """Of one edge node."""

    group: str
    node: str
    primary_host: str = ""
    """Empty: births wait for nobody."""
    leaves_waiting: bool = False
    """Whether it leaves a server where the primary host is offline before it was born there: there are others."""
    rebirth_pause: float = 2.0
    """Seconds between births that are asked for."""
    history: HistoryLimits = field(default_factory=HistoryLimits)


class EdgeNode:
    """Times are seconds of any clock that never goes back; `utc` makes milliseconds of UTC of them."""

    def __init__(
        self,
        settings: EdgeNodeSettings,
        user: EdgeNodeUser,
        utc: Callable[[float], int],
        *,
        metrics: Iterable[MetricDeclaration] = (),
        devices: Iterable[DeviceDeclaration] = (),
        next_bd_seq: int = 0,
    ) -> None:
        for name in (settings.group, settings.node, settings.primary_host or "none"):
            if fault := name_fault(name):
                raise ValueError(f"{name!r} {fault}")
        self.settings = settings
        self.state = OFFLINE
        self.next_bd_seq = next_bd_seq % SEQUENCES
        """Of the next CONNECT. The owner of the node keeps it across restarts."""
        self.births = 0
        """Birth sequences so far, the first of each session included."""
        self.history = ValueHistory(settings.history)
        self._user = user
        self._writer = MessageWriter(settings.group, settings.node, utc)
        self._roster = Roster(metrics, devices)
        self._host = PrimaryHost()
        self._host_topic = str(SparkplugTopic(MessageType.STATE, host=settings.primary_host))
        self._born_at = -settings.rebirth_pause
        self._is_rebirth_due = False

    @property
    def host_is_online(self) -> bool:
        """Whether the primary host application is known to be there."""
        return self._host.is_online

    @property
    def bd_seq(self) -> int:
        """Of the present MQTT session."""
        return self._writer.bd_seq

    # -- the connection ----------------------------------------------------------------------------------------------

    def will(self, now: float) -> SparkplugMessage:
        """The will of the next CONNECT."""
        self._writer.bd_seq = self.next_bd_seq
        return self._writer.node_death(now)

    def connecting(self) -> None:
        """The CONNECT with the latest will is about to be sent: store the new `next_bd_seq` before.

        A broker may publish that will at any time, even if it was never heard to accept the CONNECT; no later session
        may be meant by it (tck-id-topics-nbirth-bdseq-increment).
        """
        self.next_bd_seq = (self._writer.bd_seq + 1) % SEQUENCES

    def connected(self, now: float) -> None:
        """The broker has accepted the CONNECT with the latest will."""
        if not self._go(EdgeNodeSignal.CONNECTED):
            return
        self._host.session_begins()
        self._is_rebirth_due = False
        commands = [self._writer.topic(MessageType.NCMD), *map(self._command_topic, self._commanded())]
        if self.settings.primary_host:
            self._user.subscribe((*commands, self._host_topic))
            return
        self._user.subscribe(tuple(commands))
        self._go(EdgeNodeSignal.HOST_ONLINE)
        self._begin_births(now)

    def lost(self, now: float) -> None:
        """The session is over, for whatever reason. The broker publishes the will."""
        if self._go(EdgeNodeSignal.LOST):
            self._session_over()

    def close(self, now: float) -> None:
        """The session ends on purpose. The DISCONNECT has to follow (tck-id-operational-behavior-edge-node-*)."""
        if self._go(EdgeNodeSignal.CLOSED):
            self._die(now)

    def receive(self, topic: str, payload: bytes, now: float, *, is_retained: bool = False) -> None:
        """A message came."""
        if self.state is OFFLINE:
            return
        if self.settings.primary_host and topic == self._host_topic:
            self._hear_host(topic, payload, now)
            return
        parsed = parse_topic(topic)
        if parsed is None or parsed.type not in (MessageType.NCMD, MessageType.DCMD):
            self._user.ignored(topic, "is no command and no state of the primary host")
        elif (parsed.group, parsed.node) != (self.settings.group, self.settings.node):
            self._user.ignored(topic, "is for another edge node")
        elif parsed.device and parsed.device not in self._roster.devices:
            self._user.ignored(topic, "there is no such device")
        else:
            self._command(self._roster.get(parsed.device), payload, now, is_retained=is_retained)

    # -- the devices -------------------------------------------------------------------------------------------------

    def values(
        self, device: str, values: Mapping[str, MetricValue], now: float, *, keep: bool = True
    ) -> None:
        """Metrics of a device (empty: of the edge node) have changed. They are sent, or kept where `keep` says so."""
        one = self._roster.get(device)
        for name, value in values.items():
            if value.value is not None:
                encode_value(one.metrics[name].type, value.value)
        one.latest.update(values)
        one.unsent.update(dict.fromkeys(values))
        if not self._send_unsent(one, now) and keep:
            for name, value in values.items():
                self.history.add(device, StoredValue(name, value, now))

    def show(self, device: str, names: Iterable[str], now: float) -> None:
        """Send the values of these metrics as they are: the answer to a command that was refused."""
        one = self._roster.get(device)
        one.unsent.update(dict.fromkeys(names))
        self._send_unsent(one, now)

    def device_lost(self, device: str, now: float) -> None:
        """The device cannot be reached: it dies (tck-id-operational-behavior-device-ddeath)."""
        self._roster.devices[device].is_present = False
        self._settle(now)

    def device_found(self, device: str, now: float) -> None:
        """The device can be reached: it is born."""
        self._roster.devices[device].is_present = True
        self._settle(now)

    def redeclare(
        self, metrics: Iterable[MetricDeclaration], devices: Iterable[DeviceDeclaration], now: float
    ) -> None:
        """Devices and metrics are these from now on. What goes is dead, what is new or other is born."""
        former, commanded = self._roster, set(self._commanded())
        self._roster = Roster(metrics, devices, former)
        self.history.keep(self._is_known)
        if self.state is OFFLINE:
            return
        for gone in former.devices.values():
            if gone.is_born and gone.name not in self._roster.devices:
                # Not taken: the births that follow leave it out, which says the same.
                self._is_rebirth_due |= not self._send(self._writer.device_death(gone, now))
        self._subscribe_anew(commanded, set(self._commanded()))
        if self._roster.node is not former.node:
            self._rebirth(now)
        self._settle(now)

    def tick(self, now: float) -> None:
        """Do what is due: births, values that were not taken, and those of before. Call it some times a second."""
        self.history.expire(now)
        if self._is_rebirth_due and now >= self._born_at + self.settings.rebirth_pause:
            self._rebirth(now)
        self._settle(now)
        if self.state is not ONLINE:
            return
        if all(self._send_unsent(one, now) for one in self._all() if one.unsent and one.is_born):
            self._send_history(now)

    # -- inside: births and deaths -----------------------------------------------------------------------------------

    def _go(self, signal: EdgeNodeSignal) -> bool:
        """Whether the signal means anything in this state."""
        after = TRANSITIONS.get((self.state, signal))
        if after is None:
            return False
        self.state = after
        return True

    def _rebirth(self, now: float) -> None:
        """All births anew, without a death and with the same bdSeq (tck-id-...-data-commands-rebirth-action-*)."""
        self._is_rebirth_due = False
        if self._go(EdgeNodeSignal.REBIRTH):
            self._begin_births(now)

    def _begin_births(self, now: float) -> None:
        for one in self._all():
            one.is_born = False
        self._born_at = now
        self.births += 1
        self._settle(now)

    def _settle(self, now: float) -> None:
        """Send the births and deaths that are due, as far as the connection takes them."""
        if self.state not in (BEARING, ONLINE):
            return
        node = self._roster.node
        if not node.is_born:
            self._bear(node, self._writer.node_birth(node, now))
        for one in self._roster.devices.values():
            if not node.is_born or one.is_born is one.is_present:
                continue
            if one.is_present:
                self._bear(one, self._writer.device_birth(one, now))
            else:
                one.is_born = not self._send(self._writer.device_death(one, now))
        if node.is_born and all(one.is_born or not one.is_present for one in self._roster.devices.values()):
            self._go(EdgeNodeSignal.BORN)

    def _bear(self, one: RosterDevice, birth: SparkplugMessage) -> None:
        one.is_born = self._send(birth)
        if one.is_born:
            one.unsent.clear()

    def _die(self, now: float) -> None:
        if self._roster.node.is_born:
            self._send(self._writer.node_death(now))
        self._session_over()

    def _session_over(self) -> None:
        for one in self._all():
            one.is_born = False
            one.unsent.clear()
        if self._host.is_online:
            self._host.session_begins()
            self._user.host_changed(is_online=False)

    # -- inside: messages --------------------------------------------------------------------------------------------

    def _send(self, message: SparkplugMessage) -> bool:
        if not self._user.send(message):
            return False
        self._writer.sent(message)
        return True

    def _send_unsent(self, one: RosterDevice, now: float) -> bool:
        if self.state is not ONLINE or not one.is_born:
            return False
        if one.unsent:
            if not self._send(self._writer.data(one, one.unsent, now)):
                return False
            one.unsent.clear()
        return True

    def _send_history(self, now: float) -> None:
        device, batch = self.history.next_batch(now, self._is_born)
        if batch:
            values = [(stored.name, stored.value) for stored in batch]
            if self._send(self._writer.history(self._roster.get(device), values, now)):
                self.history.sent(device, batch, now)

    def _hear_host(self, topic: str, payload: bytes, now: float) -> None:
        was_online = self._host.is_online
        try:
            is_online = self._host.receive(payload)
        except PayloadError as error:
            self._user.ignored(topic, str(error))
            return
        if is_online is not was_online:
            self._user.host_changed(is_online=is_online)
        if is_online:
            if self._go(EdgeNodeSignal.HOST_ONLINE):
                self._begin_births(now)
        elif self._go(EdgeNodeSignal.HOST_OFFLINE) or (
            self.settings.leaves_waiting and self._go(EdgeNodeSignal.CLOSED)
        ):
            self._die(now)
            self._user.leave(f"the primary host {self.settings.primary_host} is offline")

    def _command(self, one: RosterDevice, payload: bytes, now: float, *, is_retained: bool) -> None:
        if is_retained:
            reason = "is retained: nobody knows when it was meant"
            self._user.command_refused(CommandRefused(one.name, (), reason))
            return
        read = read_command(one, payload)
        if read.wants_rebirth:
            self._want_rebirth(now)
        outcome = read.outcome
        if isinstance(outcome, CommandReceived) and not one.is_born:
            names = tuple(name for name, _ in outcome.values)
            outcome = CommandRefused(one.name, names, "nothing of it is known yet, or it is dead")
        if isinstance(outcome, CommandRefused):
            self._user.command_refused(outcome)
            self.show(one.name, outcome.names, now)
        elif outcome is not None:
            self._user.command(outcome)

    def _want_rebirth(self, now: float) -> None:
        if now >= self._born_at + self.settings.rebirth_pause:
            self._rebirth(now)
        elif self.state in (BEARING, ONLINE):
            self._is_rebirth_due = True

    # -- inside: what there is ---------------------------------------------------------------------------------------

    def _all(self) -> list[RosterDevice]:
        return [self._roster.node, *self._roster.devices.values()]

    def _is_born(self, device: str) -> bool:
        return self._roster.get(device).is_born

    def _is_known(self, device: str, name: str) -> bool:
        return (not device or device in self._roster.devices) and name in self._roster.get(device).metrics

    def _commanded(self) -> list[str]:
        """Devices that take commands."""
        return [name for name, one in self._roster.devices.items() if one.declaration.is_writable]

    def _command_topic(self, device: str) -> str:
        return self._writer.topic(MessageType.DCMD, device)

    def _subscribe_anew(self, before: set[str], after: set[str]) -> None:
        if gone := before - after:
            self._user.unsubscribe(tuple(map(self._command_topic, sorted(gone))))
        if new := after - before:
            self._user.subscribe(tuple(map(self._command_topic, sorted(new))))
