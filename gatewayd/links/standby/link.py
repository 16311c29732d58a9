"""The link to the other gateway: a datagram socket, the files for the address, and the station between them."""

from __future__ import annotations

import asyncio
import logging
import os
import random
import secrets
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from gatewayd.core.cell import Cell
from gatewayd.links.contract import Claim, Duty, DutyLink, Level, LinkHealth
from gatewayd.links.standby.declaration import ROLE_WORD
from gatewayd.links.standby.files import StandbyFiles, directory_of
from gatewayd.links.standby.heartbeat import Heartbeat, decode, encode
from gatewayd.links.standby.plan import Endpoint, StandbyPlan
from gatewayd.links.standby.roles import StandbyRole
from gatewayd.links.standby.served_mark import ServedMark
from gatewayd.links.standby.sight import PERIOD, Sight
from gatewayd.links.standby.station import RoleChange, StandbyStation
from gatewayd.logs.records import fields
from gatewayd.loop import clock
from gatewayd.loop.progress import wait_with_progress
from gatewayd.loop.retry import Failure, reason_of
from gatewayd.machine.addresses import own_addresses
from gatewayd.mapping.plan import LinkPlan
from gatewayd.report.format import address as address_text

LOOK_PERIOD = 0.05
"""Seconds between two looks at the addresses of this machine; while one is waited for, every call is a look."""
RETRY_PERIOD = 1.0
"""Seconds between two attempts to have the socket."""
PEER_READY = 0x100
"""Added to the role in the status word while the other gateway is ready."""

log = logging.getLogger("gatewayd.standby")


class StandbyLink(DutyLink):
    """Decides by `StandbyStation` whether the cell is served here."""

    title = "link to the other gateway"
    plan: StandbyPlan

    def __init__(self, plan: StandbyPlan, cell: Cell, state: Path) -> None:
        self.plan = plan
        self._cell = cell
        self._state = state
        number = secrets.randbits(63) + 1
        self._sight = Sight(number, cell.definition.fingerprint)
        self._mark = ServedMark(state, cell.definition.name)
        self._station = StandbyStation(
            self._sight, random.random, has_address=bool(plan.address), served_last=self._mark.read()
        )
        self._files = self._new_files()
        self._transport: asyncio.DatagramTransport | None = None
        self._progress = 0
        self._failure = Failure(self._report)
        self._address: bool | None = None
        self._looked_at = -LOOK_PERIOD
        self._changed = asyncio.Event()
        self._report_words(clock.now())

    # -- for the daemon ------------------------------------------------------------------------------------------

    @property
    def progress(self) -> int:
        """Counts heartbeats and attempts."""
        return self._progress

    def duty(self, claim: Claim, now: float) -> Duty:
        """Look at the address, move the station, and keep the files up to date."""
        self._look_at_address(now)
        change = self._station.look(claim, self._address, now)
        if change is not None:
            self._turned(change)
        if self._files is not None:
            self._files.update(now, eligible=self._station.role.has_claim)
        self._mark.write(served_last=self._station.served_last)
        self._report_words(now)
        return self._station.duty(now)

    def hand_over(self, now: float) -> str:
        """Leave the cell to the other gateway, if that is ready."""
        return self._station.hand_over(now)

    async def run(self) -> None:
        """Send heartbeats and hear those of the other gateway, until cancelled."""
        while True:
            try:
                await self._talk()
            except OSError as error:
                self._failure.failed(error)
            await wait_with_progress(asyncio.sleep(RETRY_PERIOD), self._count, RETRY_PERIOD)

    async def close(self) -> None:
        """Give the address back; the other gateway finds the claim free when the session has ended."""
        if self._files is not None:
            self._files.close()

    def rebind(self, plan: LinkPlan, cell: Cell, now: float) -> None:
        """Go on for another cell; another address or peer is used at once."""
        assert isinstance(plan, StandbyPlan)
        former, self.plan, self._cell = self.plan, plan, cell
        self._sight.fingerprint = cell.definition.fingerprint
        if former.address != plan.address:
            self._station.expect_address(now, has_address=bool(plan.address))
        if (former.peers, former.listen) != (plan.peers, plan.listen) and self._transport is not None:
            self._transport.close()
        if bool(former.address) is not bool(plan.address):
            if self._files is not None:
                self._files.close()
            self._files = self._new_files()
        self._looked_at = -LOOK_PERIOD
        self._report_words(now)

    def health(self) -> LinkHealth:
        """The role, and whether the other gateway could take over."""
        now, role = clock.now(), self._station.role
        problems = tuple(self._problems(now))
        level = Level.WARN if problems else Level.GOOD if role.serves else Level.IDLE
        detail = "the other gateway is ready" if self._sight.ready(now) else self._other(now)
        return LinkHealth("Standby", level, role.words, detail, problems, self._figures(now))

    # -- what it sees --------------------------------------------------------------------------------------------

    def _look_at_address(self, now: float) -> None:
        is_due = self._station.role is StandbyRole.TAKING_ADDRESS or now - self._looked_at >= LOOK_PERIOD
        if not self.plan.address or not is_due:
            return
        self._looked_at = now
        try:
            self._address = self.plan.address in own_addresses()
        except OSError:
            self._address = None

    def heard(self, data: bytes) -> None:
        """A datagram of the other gateway, or whatever it is."""
        self._sight.heard(decode(data), clock.now())

    def refused(self) -> None:
        """Nobody listens at the other gateway."""
        self._sight.refused()

    # -- what it says --------------------------------------------------------------------------------------------

    async def _talk(self) -> None:
        """Exchange heartbeats as long as the socket lasts. OSError if it cannot be had."""
        peer, own = self._ends()
        loop = asyncio.get_running_loop()
        transport, ears = await loop.create_datagram_endpoint(
            lambda: _Ears(self), local_addr=own, remote_addr=peer
        )
        self._transport = transport
        try:
            if self._failure.worked():
                log.info("hears the other gateway again", extra=fields(cell=self._cell.definition.name))
            while not ears.closed:
                self._count()
                transport.sendto(encode(self._heartbeat(clock.now())))
                self._changed.clear()
                with suppress(TimeoutError):
                    async with asyncio.timeout(PERIOD):
                        await self._changed.wait()
        finally:
            self._transport = None
            transport.close()

    def _ends(self) -> tuple[Endpoint, Endpoint]:
        """The other gateway, and where to hear it. OSError if this machine is neither of the two, or both."""
        plan = self.plan
        if len(plan.peers) == 1:
            (peer,) = plan.peers
            everywhere = "::" if ":" in peer[0] else "0.0.0.0"
            return peer, plan.listen or (everywhere, peer[1])
        own = own_addresses()
        here = [end for end in plan.peers if end[0] in own]
        if len(here) != 1:
            names = " and ".join(address_text(*end) for end in plan.peers)
            how = "both" if here else "neither"
            raise OSError(None, f"this machine has {how} of the two addresses of `peer`: {names}")
        (other,) = (end for end in plan.peers if end not in here)
        return other, plan.listen or here[0]

    def _heartbeat(self, now: float) -> Heartbeat:
        station, sight = self._station, self._sight
        return Heartbeat(
            role=station.role,
            connected=station.claim is not Claim.NO_SESSION,
            ready=station.ready(now),
            fingerprint=sight.fingerprint,
            number=sight.number,
            echo=sight.echo,
        )

    def _turned(self, change: RoleChange) -> None:
        level = (
            logging.WARNING if change.role is StandbyRole.MISMATCHED or change.former.serves else logging.INFO
        )
        log.log(
            level,
            "standby role changed",
            extra=fields(
                cell=self._cell.definition.name,
                role=change.role.words,
                former=change.former.words,
                reason=change.why,
            ),
        )
        self._changed.set()

    def _report(self, error: Exception) -> None:
        log.error(
            "cannot talk to the other gateway",
            extra=fields(cell=self._cell.definition.name, reason=reason_of(error), retry_s=RETRY_PERIOD),
        )

    def _count(self) -> None:
        self._progress += 1

    def _new_files(self) -> StandbyFiles | None:
        if not self.plan.address:
            return None
        return StandbyFiles(directory_of(os.environ, self._state), self._cell.definition.name)

    # -- how it is -----------------------------------------------------------------------------------------------

    def _report_words(self, now: float) -> None:
        ready = PEER_READY if self._sight.ready(now) else 0
        self._cell.health.words[ROLE_WORD] = self._station.role.value + ready

    def _other(self, now: float) -> str:
        role = self._sight.role(now)
        return "the other gateway is not heard" if role is None else f"the other gateway is {role.words}"

    def _problems(self, now: float) -> Iterator[str]:
        station, sight = self._station, self._sight
        if self._failure.reason:
            yield f"cannot talk to the other gateway: {self._failure.reason}"
        elif not sight.alive(now):
            yield "the other gateway is not heard: nobody would take over from this one"
        if sight.differs:
            heard = sight.last
            theirs = f"{heard.fingerprint:08X}" if heard is not None else "?"
            yield (
                f"the other gateway has another mapping ({theirs}, here {sight.fingerprint:08X}): it does not take "
                "over; install the same file on both and reload"
            )
        if station.unaddressed:
            yield (
                f"the virtual address {self.plan.address} did not come to this machine although the robot was claimed: "
                "does keepalived run, and follow the file? Then restart this gateway, to be handed cells again"
            )
        if self._files is not None and self._files.trouble:
            yield f"the file {self._files.path} cannot be written: {self._files.trouble}"

    def _figures(self, now: float) -> dict[str, object]:
        station, sight = self._station, self._sight
        role, age, last = sight.role(now), sight.age(now), sight.last
        return {
            "role": station.role.words,
            "reason": station.why,
            "since": round(max(0.0, now - station.since), 3) if station.since > 0 else None,
            "takeovers": station.takeovers,
            "claim": station.claim.value,
            "peer": [address_text(*end) for end in self.plan.peers],
            "peer_role": role.words if role is not None else None,
            "peer_age": round(age, 3) if last is not None else None,
            "peer_ready": sight.ready(now),
            "peer_fingerprint": f"{last.fingerprint:08X}" if last is not None else None,
            "mismatch": sight.differs,
            "strange": sight.strange,
            "address": self.plan.address or None,
            "address_here": self._address,
            "file": str(self._files.path) if self._files is not None else None,
            "obstacle": station.obstacle(now),
            "active": station.role.serves,
        }


class _Ears(asyncio.DatagramProtocol):
    """Hands on what comes; the kernel lets only the peer through, as the socket is connected to it."""

    def __init__(self, link: StandbyLink) -> None:
        self.closed = False
        self._link = link

    def datagram_received(self, data: bytes, addr: object) -> None:
        self._link.heard(data)

    def error_received(self, exc: Exception) -> None:
        if isinstance(exc, ConnectionRefusedError):
            self._link.refused()

    def connection_lost(self, exc: Exception | None) -> None:
        self.closed = True
