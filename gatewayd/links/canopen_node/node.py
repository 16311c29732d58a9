"""The node: all services of a CiA 301 slave put together over one cell. Pure: frames and time in, frames out.

Nothing is sent while the bus carries nothing: a queue would only send old news later. A node that is started while the
bus carries nothing boots when it does.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial

from gatewayd.canopen.bus import BusState
from gatewayd.canopen.clock import TimeConsumer
from gatewayd.canopen.cob_ids import Function
from gatewayd.canopen.dictionary import Dictionary, Entry, Object
from gatewayd.canopen.emergency import Emergency, ErrorCode
from gatewayd.canopen.frame import Frame, Priority, Send
from gatewayd.canopen.gap import Waiting
from gatewayd.canopen.guarding import NodeGuarding
from gatewayd.canopen.heartbeat import HeartbeatConsumer, HeartbeatProducer
from gatewayd.canopen.identity import revision_of
from gatewayd.canopen.lss import LssSlave
from gatewayd.canopen.nmt import UNCONFIGURED, NmtCommand, NmtSlave, NmtState, Service
from gatewayd.canopen.sdo.server import SdoServer
from gatewayd.canopen.sync import SyncService
from gatewayd.core.cell import Cell
from gatewayd.core.definition import Direction
from gatewayd.core.requester import Requester
from gatewayd.links.canopen_node.communication_errors import CommunicationErrors
from gatewayd.links.canopen_node.objects import cell_objects, identification_objects, service_objects
from gatewayd.links.canopen_node.observer import NodeCounters, Observer, Timed
from gatewayd.links.canopen_node.pdo.parameters import Configuration, PdoTable
from gatewayd.links.canopen_node.pdo.receive import ReceiveEngine
from gatewayd.links.canopen_node.pdo.transmit import TransmitEngine
from gatewayd.links.canopen_node.peers import Peers
from gatewayd.links.canopen_node.plan import GUARDING, CanopenPlan
from gatewayd.links.canopen_node.promise import Promises
from gatewayd.links.canopen_node.robot_errors import RobotErrors
from gatewayd.links.canopen_node.routes import Handler, Routes
from gatewayd.links.canopen_node.storage import Parameters
from gatewayd.links.canopen_node.store import Store
from gatewayd.links.canopen_node.unserved import UnservedFrames


class Node:
    """One cell as one node.

    `alive(now)` says whether the core lives: without it the heartbeat is withheld. `bit_rates` are those that the
    link can switch to for an LSS master.
    """

    def __init__(
        self,
        plan: CanopenPlan,
        cell: Cell,
        send: Send,
        store: Store,
        alive: Callable[[float], bool],
        *,
        observer: Observer | None = None,
        bit_rates: Iterable[int] = (),
    ) -> None:
        self.plan = plan
        self.cell = cell
        self.bus = BusState.ABSENT
        self.counters = NodeCounters()
        self._rpdo_writers = plan.rpdo_writers
        self._link = send
        self._observer = observer if observer is not None else Observer()
        self._now = 0.0
        self._started = False
        self._store_damaged = False
        self._routes = Routes()
        self.parameters = Parameters(
            store,
            plan.node,
            ready=lambda: self.nmt.state is not NmtState.OPERATIONAL,
            report=self._observer.report,
            failed=self._store_failed,
            ended=self._observer.deadline_changed,
            clock=self._clock,
        )
        node = self.parameters.node
        self._unserved = UnservedFrames(cell, plan.sdo_writer, self._clock, lambda: self.dictionary)
        self.nmt = NmtSlave(
            self._send, lambda: self.lss.node, self._nmt_changed, self._reset, autostart=plan.autostart
        )
        self.nmt.ignored = self._unserved.nmt
        self.emergency = Emergency(
            self._send, node, lambda: self.bus.carries and self.nmt.allows(Service.EMCY), plan.emcy_inhibit
        )
        self.robot_errors = RobotErrors(
            cell, self.emergency, lambda: self._started and self.nmt.state is not NmtState.INITIALISING
        )
        self.transmit = TransmitEngine(cell, self._send)
        self.errors = CommunicationErrors(
            self.emergency,
            self.nmt,
            self.transmit,
            self.counters,
            lose_node=self._lose_node,
            lose_rpdo=lambda number, reason, now: self._lose(self._writer_of(number), reason, now),
            behaviour=plan.error_behaviour,
        )
        self.producer = HeartbeatProducer(self._send, self.nmt, alive, plan.heartbeat)
        self.consumer = HeartbeatConsumer(
            plan.consumers,
            lost=self.errors.heartbeat_lost,
            back=self.errors.heartbeat_back,
            changed=self._watch_changed,
        )
        self.promises = Promises(
            (*plan.consumers, *plan.guarded),
            also=self.consumer.time,
            broken=partial(self._lose_node, "no heartbeat of node {}"),
            booted=partial(self._lose_node, "node {} has restarted"),
        )
        self._waiting = Waiting()
        self._peers = Peers(cell, self.promises, self.consumer, self._waiting)
        self.guarding = NodeGuarding(
            self._send,
            self.nmt,
            lambda: self.producer.enabled,
            lost=self.errors.guarding_lost,
            back=partial(self.emergency.clear, ErrorCode.HEARTBEAT),
            time=plan.guard_time,
            factor=plan.life_time_factor,
        )
        self.sync = SyncService(
            self._send,
            plan.sync,
            allowed=lambda: self.nmt.allows(Service.SYNC),
            on_sync=self._on_sync,
            wrong_length=self.errors.sync_length,
            changed=self._route,
        )
        self.time = TimeConsumer(on_time=self._observer.time_received, changed=self._route)
        self.receive_pdos = ReceiveEngine(
            cell,
            lambda number, now: self._peers.by_rpdo(self._writer_of(number), now),
            lambda number: self._peers.requester(self._writer_of(number)),
            self.errors.fault_raised,
            self.errors.fault_cleared,
        )
        self.pdos = PdoTable(
            replace(plan, node=node), cell.definition.variables, self._find, self._pdo_changed
        )
        objects = tuple(self._objects())
        self.identity = plan.identity.of(cell.definition, lambda: revision_of(objects, node))
        self.lss = LssSlave(
            self._send,
            self.identity,
            node,
            self.bit_rate,
            bit_rates=frozenset({*bit_rates, plan.bitrate}),
            configured=self._configured,
            store=self._store_lss,
            activate=self._observer.switch_bit_rate,
        )
        self.dictionary = Dictionary(
            (*objects, *identification_objects(self.identity, cell, self._clock)), self._waiting.permit
        )
        self.parameters.bind(self.dictionary)
        self.sdo = SdoServer(self.dictionary, aborted=self._unserved.sdo)
        self._timed: tuple[Timed, ...] = (
            self.sync,
            self.transmit,
            self.receive_pdos,
            self.producer,
            self.consumer,
            self.promises,
            self.guarding,
            self.robot_errors,
            self.emergency,
            self.errors,
        )

    # -- what the link calls -------------------------------------------------------------------------------------

    @property
    def node_id(self) -> int:
        """The node-ID in force; 255 for none."""
        return self.lss.node

    @property
    def bit_rate(self) -> int:
        """The bit rate to open the bus with: what LSS has stored, else the mapping's."""
        lss = self.parameters.lss
        return lss.bitrate if lss is not None and lss.bitrate is not None else self.plan.bitrate

    def cob_ids(self) -> frozenset[int]:
        """The COB-IDs of all data frames that mean anything to the node, in any NMT state."""
        return self._routes.cob_ids

    def remote_ids(self) -> frozenset[int]:
        """The COB-IDs of all remote frames that it answers: node guarding."""
        if self.node_id == UNCONFIGURED:
            return frozenset()
        return frozenset({Function.ERROR_CONTROL + self.node_id})

    def start(self, now: float) -> None:
        """Power-on: once, before anything else but `bus_changed`."""
        self._now, self._started = now, True
        self.parameters.report_differences()
        self._reset(NmtCommand.RESET_NODE, now)
        if self.bus.carries:
            self.nmt.boot(now)

    def resume(self, former: Node, now: float) -> None:
        """Instead of `start`: take the place of a node that `continuity` lets go on, over the succeeding cell.

        For the bus nothing happens: no boot-up, the same NMT state, parameters, errors, watched nodes and deadlines.
        TPDOs are sent anew. A transfer by SDO that is under way is aborted: it was of the former objects.
        """
        self._now, self._started = now, True
        self.bus, self.counters = former.bus, former.counters
        self.errors.resume(former.errors)
        self.promises.resume(former.promises)  # what was reported, before the reset compares again
        self._reset(NmtCommand.RESET_NODE, now)
        self.dictionary.resume(former.dictionary)
        self.pdos.reload()
        self.consumer.restart(now)
        self.consumer.resume(former.consumer)
        self.promises.resume(former.promises)
        self.guarding.resume(former.guarding)
        self.emergency.resume(former.emergency)
        self._waiting.resume(former._waiting)
        self._peers.resume(former._peers)
        self._route()
        self.nmt.resume(former.nmt.state, now)
        self.sync.resume(former.sync)  # from here on what entering the state has begun anew
        self.producer.resume(former.producer)
        self.receive_pdos.resume(former.receive_pdos)
        self._answer(former.sdo.abandon())

    def writers(self) -> list[Requester]:
        """The writers on this bus that are alive."""
        return self._peers.living()

    def lose_writers(self, reason: str, now: float) -> None:
        """Nobody on this bus is a writer any more; a transfer by SDO is aborted."""
        self._peers.lose_all(reason, now)
        self._answer(self.sdo.abandon())

    def receive(self, frame: Frame, now: float) -> None:
        """A frame from the bus."""
        self._now = now
        self.counters.received += 1
        handler = self._routes.handlers.get(frame.can_id)
        if handler is None:
            self.counters.ignored += 1
            return
        handler(frame, now)

    def image_changed(self, direction: Direction, now: float) -> None:
        """Values or qualities of the cell have changed: a listener of the cell."""
        self._now = now
        if direction is Direction.OUTPUT:
            self.transmit.image_changed(now)
        else:
            self.transmit.status_changed(now)
        self.robot_errors.tick(now)

    def bus_changed(self, state: BusState, now: float) -> None:
        """The bus is in another state, or reports its first one."""
        self._now = now
        old, self.bus = self.bus, state
        if old.carries and not state.carries:
            self.lose_writers(f"bus {state.name.lower().replace('_', '-')}", now)
            self.receive_pdos.forget()
            self.errors.bus_lost(now)
        elif state.carries and not old.carries and self._started:
            self.errors.bus_back(now)
        self.errors.bus_seen(state, now)

    def frames_lost(self, count: int, now: float) -> None:
        """So many received frames found no room in a buffer."""
        self._now = now
        self.errors.frames_lost(count, now)

    def gap(self, since: float, now: float) -> None:
        """The process stood still from `since` to `now`. What is received until `caught_up` may have waited so long."""
        self._now = now
        self._waiting.gap(since, now)
        self.consumer.gap(since, now)
        self.promises.gap(since, now)
        self.guarding.gap(since, now)
        self.receive_pdos.gap(since, now)

    def caught_up(self) -> None:
        """Everything that waited was received."""
        self._waiting.caught_up()

    def tick(self, now: float) -> None:
        """Do what time brings. Cheap before `next_deadline`."""
        self._now = now
        for service in self._timed:
            service.tick(now)
        self._answer(self.sdo.tick(now))

    def next_deadline(self, now: float) -> float:
        """When `tick` is wanted, not before `now`; infinity if time alone brings nothing."""
        due = min(service.next_deadline(now) for service in self._timed)
        return max(now, min(due, self.sdo.next_deadline(now)))

    def renew(self, can_id: int, now: float) -> Frame | None:
        """The cyclic frame that would be sent with this COB-ID now, in place of one that waited; None: none."""
        if can_id == Function.ERROR_CONTROL + self.node_id:
            return self.producer.frame(now)
        return self.transmit.renew(can_id, now)

    # -- received frames -----------------------------------------------------------------------------------------

    def _route(self) -> None:
        """Who gets which COB-ID; where two claim one, the service that cannot be moved has it."""
        routes: dict[int, tuple[Service, Handler]] = {Function.LSS_REQUEST: (Service.LSS, self.lss.receive)}
        if self.node_id != UNCONFIGURED:
            time = self.time.cob_id
            routes |= dict.fromkeys(self.receive_pdos.can_ids, (Service.PDO, self._receive_pdo))
            if time is not None:
                routes[time] = (Service.TIME, self.time.receive)
            routes[self.sync.cob_id] = (Service.SYNC, self.sync.receive)
            for node in (self.consumer.nodes | self.promises.nodes) - {GUARDING}:
                routes[Function.ERROR_CONTROL + node] = (Service.ERROR_CONTROL, self._peers.heartbeat)
            routes[Function.ERROR_CONTROL + self.node_id] = (Service.ERROR_CONTROL, self._receive_guarding)
            routes[Function.SDO_REQUEST + self.node_id] = (Service.SDO, self._receive_sdo)
            routes[Function.NMT] = (Service.NODE_CONTROL, self.nmt.receive)
        if self._routes.replace(routes, self.nmt.state):
            self._observer.cob_ids_changed()

    def _receive_pdo(self, frame: Frame, now: float) -> None:
        if frame.remote:
            return
        if frame.can_id in self.receive_pdos.synchronous_ids and not self.sync.window_open(now):
            self.counters.outside_window += 1
            return
        self.receive_pdos.receive(frame.can_id, frame.data, now)

    def _receive_sdo(self, frame: Frame, now: float) -> None:
        if self._unserved.is_sdo(frame):
            self._peers.heard(self.plan.sdo_writer, "SDO", now)
            self._answer(self.sdo.receive(frame.data, now))

    def _receive_guarding(self, frame: Frame, now: float) -> None:
        if frame.remote:
            if not self.producer.enabled:
                self._peers.guarded(now)
            self.guarding.receive(frame, now, late=self._waiting.seconds > 0)
        elif self.errors.doubled(now):
            self._observer.report(f"another node on the bus has the node-ID {self.node_id} too")

    def _answer(self, answers: Iterable[bytes]) -> None:
        for data in answers:
            self._send(Frame(Function.SDO_RESPONSE + self.node_id, data), Priority.ORDERED)

    def _send(self, frame: Frame, priority: Priority) -> bool:
        return self.bus.carries and self._link(frame, priority)

    # -- NMT -----------------------------------------------------------------------------------------------------

    def _nmt_changed(self, old: NmtState, new: NmtState, now: float) -> None:
        operational = new is NmtState.OPERATIONAL
        self._routes.gate(self.nmt.state)
        if old is NmtState.INITIALISING:
            self.producer.restart(now)
        if new is NmtState.STOPPED:
            self.sync.stopped()
        if not self.nmt.allows(Service.SDO):
            self.sdo.reset()
            self._lose(self.plan.sdo_writer, f"NMT state {new.name}", now)
        if old is NmtState.OPERATIONAL:
            for writer in {self.plan.rpdo_writer, *self._rpdo_writers.values()}:
                self._peers.lose(writer, f"NMT state {new.name}", now)
            self.receive_pdos.forget()
        self.receive_pdos.nmt(operational, now)
        self.transmit.nmt(operational, now)
        self.robot_errors.tick(now)
        self.emergency.tick(now)
        self._observer.nmt_changed(old, new, now)

    def _reset(self, command: NmtCommand, now: float) -> None:
        """Power-on values for what the command resets, and every service as after power-on."""
        self.lss.restart()
        self.emergency.restart(forget=command is NmtCommand.RESET_NODE)
        self.pdos.restore(self.node_id)
        self.parameters.apply(command, self.node_id)
        broken = self.pdos.reload()
        if broken:
            indices = ", ".join(f"{index:04X}h" for index in broken)
            self._observer.report(
                f"stored parameters of these PDOs are not valid, defaults are used: {indices}"
            )
        self.consumer.restart(now)
        self.promises.restart()
        self.guarding.restart()
        self.sync.restart(now)
        self._route()
        self.errors.bus_seen(self.bus, now)
        self.emergency.judge(ErrorCode.STORED_PARAMETERS, self._store_damaged, now)

    def _configured(self, now: float) -> None:
        """LSS has given a node-ID to a node that had none."""
        self._reset(NmtCommand.RESET_NODE, now)
        self.nmt.boot(now)

    # -- errors --------------------------------------------------------------------------------------------------

    def _lose(self, writer: int | None, reason: str, now: float) -> None:
        self._peers.lose(writer, reason, now)
        self.receive_pdos.forget_of(writer)

    def _writer_of(self, number: int) -> int | None:
        return self._rpdo_writers.get(number, self.plan.rpdo_writer)

    def _lose_node(self, reason: str, node: int, now: float) -> None:
        """Its writers are lost; by the mapping's promise that is no communication error, as others are."""
        reason = "guarding requests have stopped" if node == GUARDING else reason.format(node)
        for writer in self.promises.of(node):
            self._lose(writer, reason, now)

    def _watch_changed(self) -> None:
        """1016h is another one: it may watch more, but what the mapping says of writers holds whatever it says."""
        self._route()
        for text in self.promises.weakened([writer.name for writer in self.cell.definition.writers]):
            self._observer.report(text)

    def _store_failed(self, damaged: bool) -> None:
        self._store_damaged = damaged
        if self._started:
            self.emergency.judge(ErrorCode.STORED_PARAMETERS, damaged, self._now)

    # -- assembly ------------------------------------------------------------------------------------------------

    def _objects(self) -> Iterable[Object]:
        """All of them but those that say who the node is."""
        services = (
            self.emergency,
            self.sync,
            self.guarding,
            self.parameters,
            self.time,
            self.consumer,
            self.producer,
            self.errors.behaviour,
            self.pdos,
        )
        yield from service_objects(self.parameters.node, services)
        yield from cell_objects(self.plan, self.cell, self._peers, self._clock)

    def _find(self, index: int, subindex: int) -> Entry:
        return self.dictionary.entry(index, subindex)

    def _clock(self) -> float:
        return self._now

    def _pdo_changed(self, direction: Direction, number: int, configuration: Configuration | None) -> None:
        if direction is Direction.OUTPUT:
            self.transmit.configure(number, configuration)
            return
        self.receive_pdos.configure(number, configuration)
        if self._started:
            self._route()

    def _on_sync(self, counter: int | None, now: float) -> None:
        self.emergency.clear(ErrorCode.SYNC_LENGTH, now)
        self.transmit.on_sync(counter, now, late=self._waiting.seconds > 0)
        self.receive_pdos.on_sync(now)

    def _store_lss(self, node: int, bit_rate: int, answer: Callable[[bool], None]) -> None:
        self.parameters.save_lss(node, bit_rate if bit_rate != self.plan.bitrate else None, answer)
