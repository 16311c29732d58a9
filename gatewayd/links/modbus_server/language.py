"""The Modbus server's part of the mapping language."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import ClassVar, Final

from gatewayd.links.language import LinkLanguage
from gatewayd.links.modbus_places.placing import ExpandedPlacement
from gatewayd.links.modbus_places.types import PLACE_RULES, TYPE_SYNONYMS, reach_of
from gatewayd.links.modbus_server.declaration import KIND
from gatewayd.links.modbus_server.expand import ExpandedModbus, expand_modbus, placements_of
from gatewayd.links.modbus_server.plan import ModbusPlan, Network, Placement, network_text
from gatewayd.links.modbus_server.roles import role_writers, secured_plan
from gatewayd.links.modbus_server.sections import Modbus, ModbusPlaces, ModbusWriter, PlacementSpec
from gatewayd.links.modbus_server.tls_sections import RoleSpec, Tls
from gatewayd.mapping.diagnostics import Related
from gatewayd.mapping.document import Document, Part
from gatewayd.mapping.expanded import ExpandedCell, ExpandedVariable
from gatewayd.mapping.model import VariableSpec, WriterSpec
from gatewayd.mapping.reach import Reach
from gatewayd.mapping.section import Section
from gatewayd.modbus.areas import MAX_WRITE_BITS, MAX_WRITE_REGISTERS, Area
from gatewayd.modbus.exceptions import ExceptionCode

_MAX_WRITE: Final = {Area.HOLDING: MAX_WRITE_REGISTERS, Area.COIL: MAX_WRITE_BITS}


class ModbusLanguage(LinkLanguage):
    """Section `modbus`, and the key `modbus` of variables and writers."""

    key = KIND.key
    section = Modbus
    meaning = "the Modbus TCP server"
    counts_absent = True
    commands = True
    variable_keys = ModbusPlaces
    writer_keys = ModbusWriter
    writer_also_by = ("role",)
    rules = (
        *PLACE_RULES,
        *(
            f"gatewayd.links.modbus_server.rules.{name}"
            for name in ("places", "listener", "peers", "sharing", "roles", "certificates")
        ),
    )
    tables = "gatewayd.links.modbus_server.tables"
    nested: ClassVar[Mapping[tuple[type[Section], str], type[Section]]] = {
        (VariableSpec, "modbus"): PlacementSpec,
        (Modbus, "tls"): Tls,
        (Tls, "roles"): RoleSpec,
        (Tls, "without_role"): RoleSpec,
    }
    articles: ClassVar[Mapping[type[Section], str]] = {
        Modbus: "the section `modbus`",
        Tls: "the table `tls`",
        RoleSpec: "a role",
        PlacementSpec: "a placement in `modbus`",
    }
    places = (PlacementSpec,)
    telling_keys = ("listen", "unit", "allow")
    elsewhere: ClassVar[Mapping[tuple[type[Section], str], str]] = {
        **{
            (VariableSpec, key): f"`{key}` belongs to the placement: modbus: {{holding: 100, {key}: ...}}"
            for key in PlacementSpec.model_fields
        },
        **{(Modbus, key): f"`{key}` belongs to the writer" for key in ("grace", "timeout", "timeout_counts")},
    }
    synonyms: ClassVar[Mapping[tuple[str, str], str]] = TYPE_SYNONYMS
    way = "Modbus"
    writer_example = "modbus: 192.0.2.20"
    place_example = "modbus: N"

    def knows(self, writer: WriterSpec) -> bool:
        """Whether it has an address, or a role."""
        spec = writer.by(ModbusWriter)
        return bool(spec.modbus) or spec.role is not None

    def names(self, writer: WriterSpec) -> Sequence[str]:
        """Its addresses and networks, and its role."""
        spec = writer.by(ModbusWriter)
        if spec.role is not None:
            return [its.text for its in role_writers(spec, 0)]
        return [network_text(network) for network in spec.modbus]

    def writes_whole(
        self, writer: WriterSpec, variables: Sequence[ExpandedVariable], cell: ExpandedCell
    ) -> bool:
        """Whether all of them lie in an area without a gap, few enough for one request."""
        return self.knows(writer) and any(_is_block(cell, variables, area) for area in _MAX_WRITE)

    def apart(self, variables: Sequence[ExpandedVariable], cell: ExpandedCell) -> Related | None:
        """The first holding register that does not follow the one before it."""
        end: int | None = None
        for place in _first_places(cell, variables, Area.HOLDING):
            if end is not None and place.address > end:
                return Related(place.position, f"`{place.variable.name}` lies apart")
            end = max(end or 0, place.addresses.stop)
        return None

    def places_of(self, line: Part[VariableSpec], document: Document) -> bool:
        """Whether the line has an address."""
        return bool(line.spec.by(ModbusPlaces).modbus)

    def more_places(self, variable: ExpandedVariable) -> str:
        """A list that begins with what it has."""
        places = variable.spec.by(ModbusPlaces).modbus
        return f"modbus: [{places[0].address if places else 100}, ...]"

    def reaches(self, cell: ExpandedCell) -> Iterable[tuple[int, Reach]]:
        """What the registers show. A packed bit, a coil and `bool` show of every number whether it is 0."""
        for placement in placements_of(cell):
            if placement.codec is not None:
                yield placement.variable.index, reach_of(placement.codec)

    def expand(self, document: Document, variables: Sequence[ExpandedVariable]) -> ExpandedModbus:
        """The placements, be there a section or not: rules look at them too."""
        return expand_modbus(document, variables)

    def compile(self, cell: ExpandedCell) -> ModbusPlan:
        """One unit on one listener."""
        part = cell.document.part(Modbus)
        assert part is not None
        modbus = part.spec
        peers = [
            (network, index)
            for index, writer in enumerate(cell.document.writers.values())
            for network in writer.spec.by(ModbusWriter).modbus
            if writer.spec.by(ModbusWriter).role is None
        ]
        listen = next(iter(modbus.addresses.values()))
        return ModbusPlan(
            host=listen.host,
            port=listen.port,
            unit=modbus.unit,
            allow=modbus.allow,
            connections=modbus.connections,
            idle_timeout=modbus.idle_timeout,
            fill_gaps=modbus.gaps == "zero",
            ignore_gaps=modbus.write_gaps == "ignore",
            connections_per_peer=modbus.connections_per_peer,
            default_unit=modbus.default_unit,
            robot_away=ExceptionCode[modbus.robot_away.upper()],
            placements=tuple(
                Placement(placed.variable.index, placed.area, placed.address, placed.bit, placed.codec)
                for placed in placements_of(cell)
            ),
            writers=tuple(
                sorted(peers, key=lambda peer: (_host_bits(peer[0]), peer[0].version, str(peer[0])))
            ),
            tls=None if modbus.tls is None else secured_plan(modbus.tls, cell),
            plain=("listen",) in modbus.addresses,
        )


def _host_bits(network: Network) -> int:
    return network.max_prefixlen - network.prefixlen


def _is_block(cell: ExpandedCell, variables: Sequence[ExpandedVariable], area: Area) -> bool:
    places = _first_places(cell, variables, area)
    if len({place.variable.index for place in places}) < len(variables):
        return False
    covered = {address for place in places for address in place.addresses}
    span = max(covered) - min(covered) + 1
    return span == len(covered) <= _MAX_WRITE[area]


def _first_places(
    cell: ExpandedCell, variables: Sequence[ExpandedVariable], area: Area
) -> list[ExpandedPlacement]:
    """Where they lie in an area: of each the first place, by address."""
    wanted = {variable.index for variable in variables}
    first: dict[int, ExpandedPlacement] = {}
    for place in placements_of(cell):
        if place.area is area and place.variable.index in wanted:
            first.setdefault(place.variable.index, place)
    return sorted(first.values(), key=lambda place: place.address)


LANGUAGE: Final = ModbusLanguage()
