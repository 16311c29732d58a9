"""The MQTT side of one cell, as JSON: what is due goes to the broker or is kept, and commands from it are answered.

| moment | what is done |
|---|---|
| the broker is there | `available` is `online`, every value is said, then what was kept, oldest first |
| a value changes | it is said, `interval` after the last time at the earliest |
| the broker is away, or does not take what it is given | the change is kept, within the bounds of `store` |
| a command comes | it is judged by the core, and answered with the true values |
| a command was retained, or comes again | it is not carried out, and answered |
| the broker is lost | its writers are lost |
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Final

from gatewayd.core.cell import Cell
from gatewayd.core.refusal import Refusal
from gatewayd.core.unserved import Unserved
from gatewayd.links.contract import Link
from gatewayd.links.mqtt.link import MqttLink
from gatewayd.links.mqtt.payload import CellCommand, CommandError, decode_command, encode, value_fields
from gatewayd.links.mqtt.plan import AVAILABLE, HISTORY, RESULT, MqttPlan
from gatewayd.links.mqtt.session import BrokerSession
from gatewayd.links.mqtt.store import ChangeStore
from gatewayd.mapping.plan import LinkPlan
from gatewayd.mqtt.messages import Message, Received
from gatewayd.mqtt.packets import Oversized

MAX_HISTORY: Final = 25
"""Kept changes that are said in one look (20 a second): 500 a second, and live values come first."""


class JsonLink(MqttLink):
    """Says values as JSON, by a connection of its own."""

    def __init__(self, plan: MqttPlan, cell: Cell, wall: Callable[[], float] = time.time) -> None:
        self.store = ChangeStore(plan.keep, plan.size)
        self._unanswered = 0
        self._wall = wall
        super().__init__(plan, cell)

    @property
    def stored(self) -> int:
        """Changes that are kept."""
        return len(self.store)

    @property
    def dropped(self) -> int:
        """Changes beyond the bounds, and answers that the broker did not take."""
        return self.store.dropped + self._unanswered

    def rebind(self, plan: LinkPlan, cell: Cell, now: float) -> None:
        """Subscribe to other topics where there are, and keep what is kept."""
        before, store = self._command_topics(), self.store
        super().rebind(plan, cell, now)
        after = self._command_topics()
        self.store = ChangeStore(self.plan.keep, self.plan.size)
        self.store.succeed(store)
        if self.session is not None:
            self.session.client.unsubscribe([topic for topic in before if topic not in after])
            self.session.client.subscribe([topic for topic in after if topic not in before])
        self.show_words()

    # -- called by the session ---------------------------------------------------------------------------------------

    def attach(self, session: BrokerSession) -> None:
        """By a session of its own."""
        self.session = session

    def serve(self, links: Sequence[Link], now: float) -> None:
        """For itself alone."""

    def goes_on(self, links: Sequence[Link]) -> bool:
        """While it is there."""
        return list(links) == [self]

    async def preparing(self) -> None:
        """Nothing has to be kept."""

    def will(self) -> Message:
        """The broker says that the gateway is gone."""
        return self._availability(online=False)

    def connected(self, now: float) -> None:
        """Say that the gateway is there, and everything that it knows."""
        assert self.session is not None
        self._publish(self._availability(online=True))
        self.session.client.subscribe(self._command_topics())
        self.publisher.forget()
        self.tick(now)

    def lost(self, reason: str, now: float) -> None:
        """Nobody can command any more."""
        self.desk.all_lost(f"the broker is lost: {reason}", now)
        self.show_words()

    def farewell(self, now: float) -> None:
        """The gateway goes, and says so itself: the broker says its will only where nobody said good-bye."""
        self._publish(self._availability(online=False))

    def tick(self, now: float) -> None:
        """Say what is due, or keep it."""
        client = self.session.client if self.session is not None else None
        ahead = self._wall() - now
        is_there = client is not None and client.is_connected
        for sample in self.publisher.due(now, repeat=is_there, owed=client is not None and client.writable):
            found = value_fields(sample, ahead, self._unit(sample.variable))
            message = Message(self.plan.topic_of(sample.name), encode(found), 0, self.plan.retain)
            taken = self._publish(message)
            if not taken and not sample.is_first:
                self.store.add(sample, now)
            self.publisher.said(sample, now, taken=taken)
        self.store.expire(now)
        for _ in range(MAX_HISTORY):
            kept = self.store.first()
            if kept is None or client is None or not client.writable:
                break
            found = value_fields(kept, ahead, self._unit(kept.variable))
            self._publish(Message(self.plan.topic_of(f"{HISTORY}/{kept.name}"), encode(found)))
            self.store.sent()
        self.show_words()

    def oversized(self, message: Oversized, now: float) -> None:
        """A command that nobody could mean."""
        known = self._writer_of(message.topic)
        if known is not None and self.desk.take(now):
            text = f"{message.length} bytes are too many for a command"
            self.desk.ignore(known, Unserved.MALFORMED, text, now)
            self._answer(known, None, {"result": "refused", "reason": "malformed", "text": text})

    def flooded(self, count: int, now: float) -> None:
        """Too many commands."""
        self.desk.flooded(count, now)

    def received(self, message: Received, now: float) -> None:
        """A command, or what claims to be one."""
        known = self._writer_of(message.topic)
        if known is None:
            return
        if not self.desk.take(now):
            self.desk.ignore(known, Unserved.NOT_ALLOWED, "more than 100 commands a second", now)
            return
        if message.retained or message.again:
            text = "a retained command" if message.retained else "a command that was sent again"
            self.desk.ignore(known, Unserved.NOT_ALLOWED, f"{text}: nobody says when it was meant", now)
            self._answer(
                known, None, {"result": "refused", "reason": "retained", "text": f"{text} is not carried out"}
            )
            return
        try:
            command = decode_command(message.payload)
        except CommandError as error:
            self.desk.ignore(known, Unserved.MALFORMED, f"a command that is {error}", now)
            self._answer(known, None, {"result": "refused", "reason": "malformed", "text": str(error)})
            return
        self._carry_out(known, command, message.waited, now)

    # -- inside ------------------------------------------------------------------------------------------------------

    def _carry_out(self, known: str, command: CellCommand, waited: float, now: float) -> None:
        desk = self.desk
        refusal: Refusal | None = None
        meant: Sequence[int] = ()
        if command.write is not None:
            refusal, meant = desk.write(known, command.write, waited, now)
        elif command.request or command.release:
            names = command.request or command.release
            refusal, meant = desk.locks(known, names, waited, now, give_back=bool(command.release))
        elif command.release_all:
            desk.release_all(known, now)
        else:
            desk.alive(known, waited, now)
            return
        found: dict[str, object] = {"result": "done"} if refusal is None else self._words(refusal)
        found["values"] = self._values(meant, now)
        self._answer(known, command.id, found)

    def _words(self, refusal: Refusal) -> dict[str, object]:
        definition = self._cell.definition
        found: dict[str, object] = {
            "result": "refused",
            "reason": refusal.reason.name.lower(),
            "text": f"{refusal.reason.text}, {refusal.hint}" if refusal.hint else refusal.reason.text,
        }
        if refusal.variable is not None:
            found["variable"] = definition.variables[refusal.variable].name
        if refusal.holder is not None:
            found["holder"] = definition.writer_name(refusal.holder)
        return found

    def _values(self, meant: Sequence[int], now: float) -> dict[str, object]:
        """What the variables truly are now, by the names that the sender knows."""
        ahead, names = self._wall() - now, {index: name for name, index in self.desk.variables.items()}
        return {
            names[index]: value_fields(self.publisher.sample(index), ahead, self._unit(index))
            for index in dict.fromkeys(meant)
        }

    def _answer(self, known: str, name: str | int | None, found: Mapping[str, object]) -> None:
        said = {"id": name, **found} if name is not None else found
        if not self._publish(Message(f"{self.plan.topic_of(known)}/{RESULT}", encode(said))):
            self._unanswered += 1

    def _publish(self, message: Message) -> bool:
        taken = self.session is not None and self.session.client.publish(message)
        self.published += taken
        return taken

    def _availability(self, *, online: bool) -> Message:
        payload = b"online" if online else b"offline"
        return Message(self.plan.topic_of(AVAILABLE), payload, 0, retain=True)

    def _command_topics(self) -> list[str]:
        return [self.plan.topic_of(known) for known, _writer in self.plan.writers]

    def _writer_of(self, topic: str) -> str | None:
        return next((known for known, _ in self.plan.writers if self.plan.topic_of(known) == topic), None)

    def _unit(self, variable: int) -> str:
        return self._cell.definition.variables[variable].unit
