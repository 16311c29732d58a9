"""The robot link: one RTDE client and one cell.

Packages go into the image as they come. What the fieldbus writes goes out at once, then at most once per control cycle
of the controller, always as whole recipes, so that values of one request arrive in one package. Nothing is sent
before the controller's own inputs were adopted.
"""

from __future__ import annotations

import asyncio
import logging
import math
import time
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import pairwise

from gatewayd.core.cell import Cell
from gatewayd.core.definition import Direction, Value
from gatewayd.core.events import Event, EventKind
from gatewayd.core.freshness import Source
from gatewayd.logs import fields
from gatewayd.mapping.plan import RobotPlan
from gatewayd.rtde.claims import WATCHDOG_KEY
from gatewayd.rtde.client import ClientSettings, Loss, LossReason, RtdeClient, Session
from gatewayd.rtde.messages import TextMessage
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.transfer import InputTransfer, OutputTransfer, read_back

__all__ = ["LOSS_INTERVAL", "VERIFY_AFTER", "RobotLink"]

VERIFY_AFTER = 0.5
"""Seconds after a change within which the controller must read the value back."""
LOSS_INTERVAL = 60.0
"""Seconds after which a connection that still fails for the same reason is told again."""
_CYCLE_UNKNOWN = 0.002
_FEED_LIMIT = 1 << 31

log = logging.getLogger("gatewayd.robot")


@dataclass(slots=True)
class _Recipe:
    """A claimed and adopted input recipe, and what the controller was last given by it."""

    transfer: InputTransfer
    sent: tuple[Value, ...]
    sent_at: float
    echo: slice | None
    """Where packages read the whole recipe back in its own order; None if they do not."""
    changed: dict[str, float] = field(default_factory=dict)
    """When a field was last given another value."""
    doubted: set[str] = field(default_factory=set)
    """Fields whose read-back differed and that were told already."""

    def note(self, flat: tuple[Value, ...], now: float) -> None:
        """Take down that `flat` was sent."""
        former, self.sent, self.sent_at = self.sent, flat, now
        if flat == former:
            return
        for name, slot in self.transfer.slots.items():
            if flat[slot] != former[slot]:
                self.changed[name] = now
                self.doubted.discard(name)


class RobotLink:
    """Keeps `cell` and its controller in step while `run` runs."""

    def __init__(self, plan: RobotPlan, cell: Cell) -> None:
        self._plan = plan
        self._cell = cell
        watchdog = plan.watchdog
        self._client = RtdeClient(
            ClientSettings(
                plan.host,
                plan.port,
                outputs=plan.outputs,
                inputs=plan.inputs,
                watchdog=watchdog.field if watchdog is not None else None,
                frequency=plan.frequency,
            ),
            self,
        )
        self._outputs = OutputTransfer((), {})
        self._slots: dict[str, slice] = {}
        self._has_timestamp = False
        self._recipes: dict[str, _Recipe] = {}
        self._session: Session | None = None
        """What was agreed and is not adopted yet."""
        self._cycle = _CYCLE_UNKNOWN
        self._next_send = -math.inf
        self._pending: asyncio.TimerHandle | None = None
        self._feeds = 0
        self._loss_told: tuple[str, float] = ("", -math.inf)
        self._closing = False
        cell.listeners.append(self._on_change)

    async def run(self) -> None:
        """Stay connected until cancelled. Raises what is a defect, after the cell was told that the robot is lost."""
        try:
            await self._run()
        except Exception:
            with suppress(Exception):
                self.session_lost(Loss(LossReason.FAILED, "internal error", started=True))
            raise

    async def _run(self) -> None:
        if self._plan.watchdog is None:
            await self._client.run()
            return
        async with asyncio.TaskGroup() as group:
            group.create_task(self._client.run())
            group.create_task(self._feed_watchdog(1 / self._plan.watchdog.frequency))

    async def close(self) -> None:
        """Send what is still due. Cancelling `run` afterwards ends the connection; what was sent is delivered."""
        self._closing = True
        self._send(time.monotonic())

    # -- called by the client ----------------------------------------------------------------------------------------

    def session_started(self, session: Session) -> None:
        """The set-up is complete; the first package follows."""
        now = time.monotonic()
        variables = self._cell.definition.variables
        self._slots = session.outputs.slots
        self._has_timestamp = "timestamp" in self._slots
        self._outputs = OutputTransfer(variables, self._slots)
        self._cycle = 1 / session.series.base_rate if session.series is not None else _CYCLE_UNKNOWN
        self._recipes = {}
        self._session = session
        self._loss_told = ("", -math.inf)
        rate = f"{1 / session.period:g} Hz"
        self._cell.robot_connected(
            now, f"controller {session.controller}, RTDE protocol {session.protocol}, {rate}"
        )
        self._tell_availability(session, now)

    def inputs_changed(self, session: Session) -> None:
        """Registers that were in use elsewhere are ours now.

        They can be written, and anything can be sent again, once the next package has told what they hold.
        """
        self._session = session

    def values(self, flat: Sequence[Value], now: float) -> None:
        """A package."""
        cell = self._cell
        self._measure()
        if cell.freshness.state is not Source.FRESH:
            self._outputs.forget()
        timestamp = float(flat[self._slots["timestamp"]][0]) if self._has_timestamp else None
        if not cell.package_arrived(timestamp, now):
            return
        self._outputs.copy(flat, cell.image.values)
        cell.outputs_written(now)
        if self._session is not None:
            self._adopt(self._session, flat, now)
        elif self._plan.verify:
            self._verify(flat, now)

    def session_lost(self, loss: Loss) -> None:
        """The session has ended, or an attempt at one has failed."""
        now = time.monotonic()
        self._recipes = {}
        self._session = None
        self._cell.health.watchdog_fed = False
        if loss.started:
            self._cell.robot_lost(loss.text, now)
        told, at = self._loss_told
        if not loss.started and (loss.text != told or now - at >= LOSS_INTERVAL):
            self._loss_told = (loss.text, now)
            address = f"{self._plan.host}:{self._plan.port}"
            log.warning(
                "no robot", extra=fields(cell=self._cell.definition.name, robot=address, reason=loss.text)
            )

    def text(self, message: TextMessage) -> None:
        """The controller says something; it goes to the log."""
        log.warning(
            "the controller says",
            extra=fields(
                cell=self._cell.definition.name,
                text=message.message,
                source=message.source or None,
                level=message.level,
            ),
        )

    # -- robot -> cell -----------------------------------------------------------------------------------------------

    def _measure(self) -> None:
        statistics, health = self._client.statistics, self._cell.health
        health.skipped = statistics.skipped
        health.late = statistics.late
        health.frequency = statistics.frequency

    def _tell_availability(self, session: Session, now: float) -> None:
        """Availability of every variable by its field; the reason is the controller's word and its likely cause."""
        refused = {(one.field, one.output): f"{one.word}: {one.hint}" for one in session.unavailable}
        for index, variable in enumerate(self._cell.definition.variables):
            reason = refused.get((variable.field, variable.direction is Direction.OUTPUT))
            self._cell.set_availability([index], reason is None, reason or variable.field, now)

    def _adopt(self, session: Session, flat: Sequence[Value], now: float) -> None:
        """Take over what the controller's inputs hold, as the package reads them back."""
        self._session = None
        former, self._recipes = self._recipes, {}
        values: dict[int, Value] = {}
        for key, claimed in session.inputs.items():
            if key == WATCHDOG_KEY:
                continue
            recipe = claimed.recipe
            transfer = InputTransfer(self._cell.definition.variables, recipe.names, recipe.slots)
            known, told = _known(former.get(key)), read_back(flat, self._slots, recipe.names)
            transfer.rebase(known | told)
            adopted = transfer.adopted(told.keys() - known.keys())
            values |= adopted
            sent = self._present(transfer, adopted, known)
            self._recipes[key] = _Recipe(transfer, sent, now, self._echo(recipe))
        self._tell_availability(session, now)
        self._cell.adopt(values, now)

    def _present(
        self, transfer: InputTransfer, adopted: Mapping[int, Value], known: Mapping[str, Sequence[Value]]
    ) -> tuple[Value, ...]:
        """What need not be sent: what was sent or told by the controller, and what neither it nor a writer told."""
        values = self._cell.image.values.copy()
        for index, value in adopted.items():
            values[index] = value
        flat = list(transfer.gather(values))
        for name, sent in known.items():
            flat[transfer.slots[name]] = sent
        return tuple(flat)

    def _echo(self, recipe: Recipe) -> slice | None:
        slots = [self._slots.get(name) for name in recipe.names]
        if None in slots or any(a.stop != b.start for a, b in pairwise(filter(None, slots))):
            return None
        return slice(slots[0].start, slots[-1].stop) if slots[0] and slots[-1] else None

    def _verify(self, flat: Sequence[Value], now: float) -> None:
        """Tell once of every input that does not read back what was sent."""
        for recipe in self._recipes.values():
            if recipe.echo is not None and flat[recipe.echo] == recipe.sent and not recipe.doubted:
                continue
            for name, wanted in recipe.transfer.slots.items():
                slot = self._slots.get(name)
                if now - recipe.changed.get(name, -math.inf) < VERIFY_AFTER:
                    continue
                if slot is None or _same(flat[slot], recipe.sent[wanted]):
                    recipe.doubted.discard(name)
                elif name not in recipe.doubted:
                    recipe.doubted.add(name)
                    self._doubt(name, recipe.sent[wanted], flat[slot], now)

    def _doubt(self, name: str, sent: Sequence[Value], held: Sequence[Value], now: float) -> None:
        self._cell.health.read_back_mismatches += 1
        variables = enumerate(self._cell.definition.variables)
        index = next(
            (i for i, one in variables if one.field == name and one.direction is Direction.INPUT), None
        )
        text = f"{name}: sent {_text(sent)}, the controller holds {_text(held)}"
        self._cell.events.append(Event(now, EventKind.READ_BACK_DIFFERS, variable=index, detail=text))

    # -- cell -> robot -----------------------------------------------------------------------------------------------

    def _on_change(self, direction: Direction) -> None:
        if direction is Direction.OUTPUT or not self._recipes or self._session is not None or self._pending:
            return
        now = time.monotonic()
        if now >= self._next_send:
            self._send(now)
        else:
            loop = asyncio.get_running_loop()
            self._pending = loop.call_later(self._next_send - now, self._send_pending)

    def _send_pending(self) -> None:
        self._pending = None
        self._send(time.monotonic())

    def _send(self, now: float) -> None:
        """Send every recipe of which something was written or has changed."""
        if self._session is not None:
            return
        image = self._cell.image
        for key, recipe in self._recipes.items():
            flat = recipe.transfer.gather(image.values)
            written = any(image.times[index] > recipe.sent_at for index in recipe.transfer.members)
            if written or flat != recipe.sent:
                self._next_send = now + self._cycle
                if self._client.send(key, flat):
                    recipe.note(flat, now)

    async def _feed_watchdog(self, period: float) -> None:
        while True:
            await asyncio.sleep(period)
            health = self._cell.health
            health.watchdog_fed = self._is_healthy() and self._client.send(WATCHDOG_KEY, (self._feeds,))
            self._feeds = (self._feeds + 1) % _FEED_LIMIT

    def _is_healthy(self) -> bool:
        """Whether the robot is heard, and every writer that the watchdog stands for is alive."""
        watchdog, cell = self._plan.watchdog, self._cell
        if watchdog is None or self._closing or cell.freshness.state is not Source.FRESH:
            return False
        return all(cell.writers.alive[writer] for writer in watchdog.requires)


def _known(recipe: _Recipe | None) -> dict[str, Sequence[Value]]:
    """What was last sent, by field: for inputs that the controller does not read back."""
    if recipe is None:
        return {}
    return {name: recipe.sent[slot] for name, slot in recipe.transfer.slots.items()}


def _same(held: Sequence[Value], sent: Sequence[Value]) -> bool:
    """Equal, where NaN equals NaN."""
    return all(a == b or (a != a and b != b) for a, b in zip(held, sent, strict=True))  # noqa: PLR0124


def _text(values: Iterable[Value]) -> str:
    return " ".join(f"{value:g}" if isinstance(value, float) else str(value) for value in values)
