"""What the MQTT side of a cell is, whether it says its values as JSON or by Sparkplug."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition
from gatewayd.core.requester import Requester
from gatewayd.links.contract import Level, Link, LinkHealth
from gatewayd.links.mqtt.commands import CommandDesk
from gatewayd.links.mqtt.declaration import STATE_WORD, STORED_WORD
from gatewayd.links.mqtt.description import root_of
from gatewayd.links.mqtt.plan import MqttPlan
from gatewayd.links.mqtt.publisher import Publisher
from gatewayd.links.mqtt.session import BrokerSession
from gatewayd.mapping.plan import LinkPlan
from gatewayd.report.format import address, counted

MAX_STORED: Final = 0xFFFF
NOT_CONNECTED, SLOW, CONNECTED, WAITING = 1, 2, 3, 4
STATE_WORDS: Final = {
    NOT_CONNECTED: "not connected",
    SLOW: "slow",
    CONNECTED: "connected",
    WAITING: "waiting for the primary host",
}


class MqttLink(Link):
    """Has no work of its own: the session that `Brokers.serve` gives it calls it, or its edge node."""

    title = "MQTT link"
    plan: MqttPlan

    def __init__(self, plan: MqttPlan, cell: Cell) -> None:
        self.plan = plan
        self.session: BrokerSession | None = None
        self.desk = CommandDesk(plan, cell)
        self.published = 0
        self._cell = cell
        self.publisher = self._publisher()
        self.show_words()

    def _publisher(self) -> Publisher:
        return Publisher(self.plan.publications, self._cell.image, self.plan.every)

    @property
    def stored(self) -> int:
        """Changes that are kept."""
        return 0

    @property
    def dropped(self) -> int:
        """What the broker never got."""
        return 0

    # -- the contract ------------------------------------------------------------------------------------------------

    @property
    def reachable(self) -> bool | None:
        """While the broker is there, where somebody commands by it."""
        if not self.plan.writers:
            return None
        return self.session is not None and self.session.client.is_connected

    def departing(self, plan: LinkPlan | None, after: CellDefinition) -> Mapping[Requester, str]:
        """Writers that the new mapping does not have at the same topic."""
        assert plan is None or isinstance(plan, MqttPlan)
        return self.desk.departing(plan, after)

    def release(self, plan: LinkPlan | None, after: CellDefinition, now: float) -> None:
        """They are lost at once."""
        assert plan is None or isinstance(plan, MqttPlan)
        self.desk.release(plan, after, now)

    def rebind(self, plan: LinkPlan, cell: Cell, now: float) -> None:
        """Go on by the same connection; what changed is said."""
        assert isinstance(plan, MqttPlan)
        former = self.publisher
        self.plan, self._cell = plan, cell
        self.desk.bind(plan, cell)
        self.publisher = self._publisher()
        self.publisher.succeed(former)
        self.show_words()

    def health(self) -> LinkHealth:
        """The connection, and what went by it."""
        where, session = address(self.plan.host, self.plan.port), self.session
        state = self.state()
        trouble = session.trouble if session is not None else "not begun"
        refused = dict(session.refused) if session is not None else {}
        figures: dict[str, object] = {
            "broker": where,
            "client": self.plan.client,
            "topic": root_of(self.plan),
            "state": STATE_WORDS[state],
            "trouble": trouble or "; ".join(f"{topic}: {why}" for topic, why in refused.items()),
            "up": int(state != NOT_CONNECTED),
            "connections": session.client.connections if session is not None else 0,
            "published": self.published,
            "stored": self.stored,
            "dropped": self.dropped,
            "commands": self.desk.done,
            "refused": dict(sorted(self.desk.refused.items())),
        }
        problems = [f"broker {where}: {trouble}"] if trouble else []
        problems += [f"broker {where} does not send {topic}: {why}" for topic, why in refused.items()]
        level = Level.GOOD if state == CONNECTED and not refused else Level.WARN
        detail = f"{counted(self.stored, 'change')} kept" if self.stored else ""
        return LinkHealth(
            f"MQTT {where}",
            Level.BAD if state == NOT_CONNECTED else level,
            STATE_WORDS[state],
            trouble or detail,
            tuple(problems),
            figures,
        )

    # -- for the part that publishes its values ----------------------------------------------------------------------

    def state(self) -> int:
        """Of the connection, as the status block has it."""
        if self.session is None or not self.session.client.is_connected:
            return NOT_CONNECTED
        return CONNECTED if self.session.client.writable else SLOW

    def show_words(self) -> None:
        """Bring the status block up to date."""
        self._cell.health.words[STATE_WORD] = self.state()
        self._cell.health.words[STORED_WORD] = min(self.stored, MAX_STORED)
