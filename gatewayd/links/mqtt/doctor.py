"""What `gatewayd doctor` looks at of a broker: files, connection, and whether commands would be heard."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Sequence
from contextlib import suppress
from dataclasses import replace

from gatewayd.core.definition import CellDefinition
from gatewayd.links.examination import Examination, Observation, Outcome, Surroundings
from gatewayd.links.mqtt.declaration import KIND
from gatewayd.links.mqtt.plan import MqttPlan
from gatewayd.mapping.plan import LinkPlan
from gatewayd.mqtt.client import CONNECT_WITHIN, MqttClient
from gatewayd.mqtt.messages import Message, Received
from gatewayd.mqtt.packets import Oversized
from gatewayd.report.format import address

CHECK = "broker"
WITHIN = 4 * CONNECT_WITHIN


class BrokerExamination(Examination):
    """Connects under another name, subscribes as the gateway would, and publishes nothing."""

    async def examine(
        self, plan: LinkPlan, cell: CellDefinition, around: Surroundings
    ) -> AsyncIterator[Observation]:
        """See Examination."""
        assert isinstance(plan, MqttPlan)
        where = address(plan.host, plan.port)
        served = [link for known in around.running for link in known.links(KIND.title)]
        mine = next(
            (link for link in served if (link["broker"], link["client"]) == (where, plan.client)), None
        )
        if mine is not None and mine.get("state") != "not connected":
            yield Observation.well(
                CHECK, f"{where}: the running gateway is {mine.get('state')} as {plan.client}"
            )
            return
        visit = _Visit(plan)
        trouble = await visit.made()
        if trouble:
            yield Observation(
                CHECK, Outcome.PROBLEM, f"{where}: {trouble}", _cause(trouble), _remedy(plan, trouble)
            )
            return
        whose = f" of {plan.username}" if plan.username else ""
        yield Observation.well(CHECK, f"{where} takes the connection{whose}")
        for topic in visit.topics:
            why = visit.answers.get(topic)
            if why is None or why:
                text = f"{where} does not send {topic}: {why or 'no answer'}"
                remedy = f"allow {plan.username or 'the gateway'} to read it, in the broker's access list"
                yield Observation(CHECK, Outcome.PROBLEM, text, "no command reaches the cell", remedy)
            else:
                yield Observation.well(CHECK, f"{where} sends {topic}")


class _Visit:
    """One connection, under a name that ends no other one."""

    def __init__(self, plan: MqttPlan) -> None:
        self.topics: Sequence[str] = command_topics(plan)
        self.answers: dict[str, str] = {}
        self._settings = replace(plan.broker, client=f"{plan.client}-doctor")
        self._met: asyncio.Future[str] = asyncio.get_running_loop().create_future()
        self._client = MqttClient(self._settings, self)

    async def made(self) -> str:
        """Why it did not come about; empty: it did, and the broker has answered."""
        work = asyncio.create_task(self._client.run())
        try:
            async with asyncio.timeout(WITHIN):
                return await self._met
        except TimeoutError:
            return "" if self._client.is_connected else f"no answer within {WITHIN:g} s"
        finally:
            await self._client.leave()
            work.cancel()
            with suppress(asyncio.CancelledError):
                await work

    async def preparing(self) -> None:
        """Nothing has to be kept."""

    def will(self) -> Message | None:
        """None: a visitor leaves nothing."""
        return None

    def connected(self) -> None:
        """Ask as the gateway would."""
        if self.topics:
            self._client.subscribe(self.topics)
        else:
            self._end("")

    def subscription(self, topics: Sequence[str], why: str) -> None:
        """The broker has answered."""
        self.answers.update(dict.fromkeys(topics, why))
        if self.answers.keys() >= set(self.topics):
            self._end("")

    def received(self, message: Received) -> None:
        """Nothing is done with it."""

    def flooded(self, count: int) -> None:
        """Nothing is done about it."""

    def oversized(self, message: Oversized) -> None:
        """Nothing is done with it."""

    def lost(self, reason: str, *, was_connected: bool) -> None:
        """It did not last."""
        self._end(reason)

    def _end(self, trouble: str) -> None:
        if not self._met.done():
            self._met.set_result(trouble)


def command_topics(plan: MqttPlan) -> list[str]:
    """What the gateway subscribes to for commands as JSON."""
    return [plan.topic_of(known) for known, _writer in plan.writers] if plan.sparkplug is None else []


def _is_unresolved(trouble: str) -> bool:
    """What getaddrinfo(3) says of a name without an address."""
    return "name resolution" in trouble or "name or service not known" in trouble


def _cause(trouble: str) -> str:
    lower = trouble.lower()
    if _is_unresolved(lower):
        return "no name server that this machine asks knows the name, or none answers"
    if "certificate" in lower or "tls" in lower:
        return "broker and mapping do not agree about TLS"
    if "not authorized" in lower or "user name" in lower or "refuses" in lower:
        return "the broker does not know the gateway, or its password"
    return "the broker is not there, or the way to it is closed"


def _remedy(plan: MqttPlan, trouble: str) -> str:
    lower = trouble.lower()
    if _is_unresolved(lower):
        return (
            f"correct `mqtt: host: {plan.host}` or the name servers of this machine, or write the IP address"
        )
    if "certificate" in lower or "tls" in lower:
        return "compare port and authorities with the broker's (`mqtt: tls: {ca: ...}`, openssl s_client -connect)"
    if "not authorized" in lower or "user name" in lower or "refuses" in lower:
        return "compare `username` and the first line of `password_file` with the broker's"
    return f"look whether the broker listens at {address(plan.host, plan.port)}, and at the firewall between"


EXAMINATION = BrokerExamination()
"""Looks at what this kind of link needs."""
