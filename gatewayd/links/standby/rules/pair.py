"""Rules GW880 to GW884: what makes two gateways a pair."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from gatewayd.core.definition import Direction
from gatewayd.links.standby.sections import Standby
from gatewayd.mapping.diagnostics import Diagnostic, Related, Rule, Severity
from gatewayd.mapping.document import Part
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.rules.registry import cell_rule, plant_rule


@cell_rule("GW880")
def standby_without_inputs(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Two gateways, and no input of the robot that only one of them can claim."""
    standby = cell.document.part(Standby)
    if standby is None or any(
        variable.direction is Direction.INPUT and not variable.via for variable in cell.variables
    ):
        return
    message = "nothing decides between the two gateways: the mapping claims no input of the robot"
    hint = "map an input register, even if nobody uses it, for example `pair: {robot: input_int_register_23}`"
    yield rule.at(standby.key, message, hint=hint)


@plant_rule("GW881")
def standby_address_shared(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """Two cells whose virtual address is the same."""
    first: dict[str, tuple[ExpandedCell, Part[Standby]]] = {}
    for cell, standby in _pairs(cells):
        address = standby.spec.address
        if address is None:
            continue
        other, earlier = first.setdefault(address, (cell, standby))
        if other is not cell:
            message = f"{address} is the virtual address of the cell `{other.document.cell}` already"
            related = (Related(earlier.at("address"), f"{address} first used here"),)
            hint = (
                "give each cell a virtual address of its own: their robots decide one by one who serves them"
            )
            yield rule.at(standby.at("address"), message, hint=hint, related=related)


@cell_rule("GW882")
def standby_peer_itself(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """The other gateway is said to be where this one or the virtual address is."""
    standby = cell.document.part(Standby)
    if standby is None:
        return
    spec = standby.spec
    hosts = [peer.host for peer in spec.peer]
    hint = "name the own address of the other machine"
    if len(set(hosts)) < len(hosts):
        message = f"both entries of `peer` are {hosts[0]}"
        yield rule.at(standby.at("peer"), message, hint=hint)
    if spec.listen is not None and spec.listen in spec.peer and len(hosts) == 1:
        message = f"`peer` and `listen` are both {spec.listen}"
        yield rule.at(standby.at("listen"), message, hint=hint)
    if spec.address in hosts:
        message = f"`peer` is the virtual address {spec.address}, which moves from one machine to the other"
        yield rule.at(standby.at("peer"), message, hint=hint)


@plant_rule("GW883")
def standby_port_shared(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """Two cells that hear their other gateway at one port."""
    first: dict[int, tuple[ExpandedCell, Part[Standby]]] = {}
    for cell, standby in _pairs(cells):
        port = (standby.spec.listen or standby.spec.peer[0]).port
        other, earlier = first.setdefault(port, (cell, standby))
        if other is not cell:
            message = f"UDP port {port} is that of the cell `{other.document.cell}` already"
            related = (Related(earlier.at("peer"), f"port {port} first used here"),)
            yield rule.at(
                standby.at("peer"), message, hint="give each cell a port of its own", related=related
            )


@cell_rule("GW884", Severity.WARNING)
def standby_clears(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """Two gateways, and inputs that are cleared whenever one connects."""
    standby = cell.document.part(Standby)
    if standby is not None and cell.settings.clear_on_connect:
        message = (
            "every takeover clears the robot's inputs, as `on_connect: fallback` says; `grace` never counts"
        )
        hint = "remove `on_connect: fallback`: the inputs then keep their values until their owners are back"
        yield rule.at(standby.key, message, hint=hint)


def _pairs(cells: Sequence[ExpandedCell]) -> Iterator[tuple[ExpandedCell, Part[Standby]]]:
    for cell in cells:
        part = cell.document.part(Standby)
        if part is not None:
            yield cell, part
