"""What is looked at of a robot: its name, the way there, its RTDE service, and what it has of the mapping.

One visit by the client of the daemon. Inputs are claimed only where that was asked for, and never those that a gateway
on this machine holds: it says of them itself what it knows.
"""

from __future__ import annotations

import ipaddress
import socket
from collections.abc import AsyncIterator, Collection, Iterator, Sequence

from gatewayd.core.definition import CellDefinition
from gatewayd.links.examination import Examination, Observation, Outcome, RunningCell, Surroundings
from gatewayd.links.robot import diagnosis
from gatewayd.links.robot.companions import all_inputs, all_outputs
from gatewayd.links.robot.declaration import KIND
from gatewayd.links.robot.plan import RobotPlan
from gatewayd.links.route import look_up_route
from gatewayd.loop.resolve import hosts, resolve
from gatewayd.machine.ports import connect_error
from gatewayd.mapping.plan import LinkPlan
from gatewayd.report.format import address, counted, split_address
from gatewayd.rtde.catalogue import bit_word
from gatewayd.rtde.companions import COMPANIONS
from gatewayd.rtde.fields import OUTPUTS
from gatewayd.rtde.session import ClientSettings, Session
from gatewayd.rtde.survey import Survey, survey
from gatewayd.rtde.visit import visit

LISTEN = 1.0
"""Seconds for which packages are counted."""
RESOLVE = 5.0
"""Seconds for the addresses of a name."""
CONNECT = 3.0
"""Seconds for a connection."""


class RobotExamination(Examination):
    """See the module."""

    async def examine(
        self, plan: LinkPlan, cell: CellDefinition, around: Surroundings
    ) -> AsyncIterator[Observation]:
        """See Examination."""
        assert isinstance(plan, RobotPlan)
        try:
            addresses = hosts(await resolve(plan.host, plan.port, RESOLVE))
        except OSError as error:
            yield _unresolved(plan, error)
            return
        yield Observation.well("name", _name(plan.host, addresses))
        for found in look_up_route(addresses[0], "the robot"):
            yield found
        where = address(plan.host, plan.port)
        failure = await connect_error(addresses, plan.port, CONNECT)
        if failure is not None:
            yield diagnosis.port_refused(failure, where)
            return
        yield Observation.well(diagnosis.PORT, f"{where} is open")
        serving = await _serving(plan, addresses, around.running)
        async for found in _met(plan, cell, serving, probe=around.probe_claims):
            yield found


async def _met(
    plan: RobotPlan, cell: CellDefinition, serving: Sequence[RunningCell], *, probe: bool
) -> AsyncIterator[Observation]:
    """What a visit shows."""
    inputs = wanted_inputs(plan, cell)
    own = own_claims(plan, serving) & set(inputs)
    asked = tuple(name for name in inputs if name not in own) if probe else ()
    read = tuple(name for name in inputs if name in OUTPUTS)
    settings = _settings(plan, cell, read)
    visited = await visit(settings, LISTEN)
    session = visited.session
    if session is None:
        yield diagnosis.session_missing(visited.loss)
    else:
        for found in (*diagnosis.spoken(session, plan), *diagnosis.outputs(session, plan, cell, read)):
            yield found
        yield diagnosis.rate(visited, session)
        # By visits of their own, as short as can be: what they claim is taken from all others meanwhile.
        claimed = await survey(settings, (), asked) if asked else None
        for found in _claims(claimed, session, own, serving):
            yield found
        if not probe and len(own) < len(inputs):
            yield _not_probed(len(inputs) - len(own))
    for found in diagnosis.text_messages(visited.texts):
        yield found
    for package in visited.strange:
        yield Observation("package", Outcome.NOTE, f"could not be used: {package.reason}")


def _claims(
    claimed: Survey | None, session: Session, own: Collection[str], serving: Sequence[RunningCell]
) -> Iterator[Observation]:
    """What is known of claims: by claiming, and from the gateway on this machine."""
    if claimed is not None:
        text = f"{counted(len(claimed.inputs), 'input')} claimed for a moment to see what others hold, and given back"
        yield Observation("claims", Outcome.NOTE, text)
        yield from diagnosis.claims(claimed.inputs, session)
        if claimed.loss is not None:
            yield diagnosis.session_missing(claimed.loss)
    if own:
        yield Observation.well(
            "claims", f"{counted(len(own), 'input')} claimed by the gateway on this machine"
        )
    yield from diagnosis.held(elsewhere(serving))


def _not_probed(inputs: int) -> Observation:
    return Observation(
        "claims",
        Outcome.SKIPPED,
        f"{counted(inputs, 'input')} not tried: only claiming shows what others hold, and it takes that from all "
        "others for a moment (--probe-claims)",
    )


def wanted_inputs(plan: RobotPlan, cell: CellDefinition) -> tuple[str, ...]:
    """Fields that the gateway would claim, the watchdog's among them."""
    watchdog = (plan.watchdog.field,) if plan.watchdog is not None else ()
    return tuple(dict.fromkeys((*all_inputs(plan.inputs, cell.variables), *watchdog)))


def _settings(plan: RobotPlan, cell: CellDefinition, read: Sequence[str]) -> ClientSettings:
    outputs = (*all_outputs(plan.outputs, cell.variables), *read)
    return ClientSettings(host=plan.host, port=plan.port, outputs=outputs, frequency=plan.frequency)


def _name(host: str, addresses: Sequence[str]) -> str:
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return f"{host} is {', '.join(addresses)}"
    return f"{host} is an address"


def _unresolved(plan: RobotPlan, error: OSError) -> Observation:
    reason = error.strerror if isinstance(error, socket.gaierror) else "no name server answers"
    return Observation(
        "name",
        Outcome.PROBLEM,
        f"{plan.host}: {reason or error}",
        "the name is misspelt, or no name server that this machine asks knows it",
        "write the robot's address under `robot: host:`, or enter the name in /etc/hosts",
    )


# -- a gateway on this machine that serves the same robot ----------------------------------------------------------


async def _serving(
    plan: RobotPlan, addresses: Sequence[str], running: Sequence[RunningCell]
) -> list[RunningCell]:
    """The cells that are connected to this robot from here."""
    found = []
    for cell in running:
        for link in cell.links(KIND.title):
            host, port = split_address(str(link.get("address", ""))) or ("", None)
            if port == plan.port and await _is_same(host, plan.host, addresses):
                found.append(cell)
    return found


async def _is_same(host: str, other: str, addresses: Sequence[str]) -> bool:
    if host == other:
        return True
    try:
        return not set(addresses).isdisjoint(hosts(await resolve(host, 0, RESOLVE)))
    except OSError:
        return False


def own_claims(plan: RobotPlan, serving: Sequence[RunningCell]) -> set[str]:
    """Inputs that these cells claim, whether they hold them or not."""
    fields: set[str] = set()
    for cell in serving:
        inputs = (variable for variable in cell.variables if variable.get("direction") == "input")
        fields |= {carrier_of(str(variable.get("robot", ""))) for variable in inputs}
        feeds = any(link.get("watchdog") is not None for link in cell.links(KIND.title))
        if feeds and plan.watchdog is not None:
            fields.add(plan.watchdog.field)
    types = {COMPANIONS[name].type for name in fields if name in COMPANIONS}
    return fields | {name for name in types if name is not None}


def carrier_of(name: str) -> str:
    """The field of `input_int_register_3`, `input_bit_register_5`, `target_q[2]`, `speed_slider_mask.0`."""
    field = name.partition("[")[0].partition(".")[0]
    side, _, number = field.partition("_bit_register_")
    if number.isdecimal() and int(number) < 64 and side in ("input", "output"):
        return bit_word(side, int(number))[0]
    return field


def elsewhere(serving: Sequence[RunningCell]) -> dict[str, str]:
    """Inputs that the gateway says others hold -> who that probably is."""
    return {
        str(held.get("field")): str(held.get("probably"))
        for cell in serving
        for link in cell.links(KIND.title)
        for held in link.get("held_elsewhere") or ()
    }


EXAMINATION = RobotExamination()
"""Looks at what this kind of link needs."""
