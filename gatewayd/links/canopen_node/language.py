"""The CANopen node's part of the mapping language.

What lays a node out and compiles it is imported where a file has one: most have none.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, ClassVar, Final, cast

from gatewayd.links.canopen_node.declaration import KIND
from gatewayd.links.canopen_node.sections import (
    AUTO,
    NO_PDO,
    Canopen,
    CanopenPlace,
    CanopenPlaces,
    CanopenWriter,
    CobIdPool,
    Emcy,
    Guarding,
    IdentitySpec,
    PdoDefaults,
    PdoSpec,
    Sync,
)
from gatewayd.links.language import LinkLanguage
from gatewayd.mapping import syntax
from gatewayd.mapping.diagnostics import Diagnostic
from gatewayd.mapping.document import Document, Part
from gatewayd.mapping.expanded import ExpandedCell, ExpandedVariable
from gatewayd.mapping.model import VariableSpec, WriterSpec
from gatewayd.mapping.reach import Reach
from gatewayd.mapping.section import Section

if TYPE_CHECKING:
    from gatewayd.links.can_buses import BusUse
    from gatewayd.links.canopen_node.expand import CanopenCell
    from gatewayd.links.canopen_node.plan import CanopenPlan

_RPDO: Final = "RPDO"
_SDO: Final = "SDO"


class CanopenLanguage(LinkLanguage):
    """Section `canopen`, the key `canopen` of variables; `canopen`, `node`, `heartbeat`, `guarding` of writers."""

    key = KIND.key
    commands = True
    section = Canopen
    meaning = "the CANopen node"
    variable_keys = CanopenPlaces
    writer_keys = CanopenWriter
    rules = tuple(
        f"gatewayd.links.canopen_node.rules.{name}" for name in ("node", "pdos", "pdo_members", "bus")
    )
    tables = "gatewayd.links.canopen_node.tables"
    nested: ClassVar[Mapping[tuple[type[Section], str], type[Section]]] = {
        (VariableSpec, "canopen"): CanopenPlace,
        (Canopen, "identity"): IdentitySpec,
        (Canopen, "sync"): Sync,
        (Canopen, "guarding"): Guarding,
        (Canopen, "emcy"): Emcy,
        (Canopen, "pdo"): PdoDefaults,
        (Canopen, "cob_ids"): CobIdPool,
        (Canopen, "pdos"): PdoSpec,
    }
    articles: ClassVar[Mapping[type[Section], str]] = {
        Canopen: "the section `canopen`",
        CanopenPlace: "`canopen` of a variable",
        IdentitySpec: "the table `identity`",
        Sync: "the table `sync`",
        Guarding: "the table `guarding`",
        Emcy: "the table `emcy`",
        PdoDefaults: "the table `pdo`",
        CobIdPool: "the table `cob_ids`",
        PdoSpec: "a PDO",
    }
    telling_keys = ("channel", "bitrate", "node", "pdos")
    writer_example = "canopen: rpdo"
    supervision_example = "node: 1, heartbeat: 1s"
    lost_by = "a CANopen writer is lost by its heartbeat or its timeout"
    place_example = "canopen: auto"

    def broken(self, part: Part[Section]) -> Iterable[Diagnostic]:
        """PDOs with a name that means something else."""
        node = part.of(Canopen)
        for name in (AUTO, NO_PDO):
            if node is not None and name in node.spec.pdos:
                message = f"a PDO cannot be called `{name}`: the word has a meaning of its own"
                yield syntax.BAD_NAME.at(part.key_at("pdos", name), message, hint="choose another name")

    def knows(self, writer: WriterSpec) -> bool:
        """Whether it writes by a service of the node."""
        return writer.by(CanopenWriter).canopen is not None

    def names(self, writer: WriterSpec) -> Sequence[str]:
        """The services by which it writes, and whose heartbeat is watched."""
        spec = writer.by(CanopenWriter)
        if spec.canopen is None:
            return ()
        services = "RPDO and SDO" if spec.canopen == "any" else spec.canopen.upper()
        if spec.guarding is not None:
            services += ", guarding"
        return (services if spec.node is None else f"{services}, heartbeat of node {spec.node}",)

    def silence(self, writer: WriterSpec) -> float | None:
        """Its heartbeat time, or that of its guarding."""
        spec = writer.by(CanopenWriter)
        return min((time for time in (spec.heartbeat, spec.guarding) if time is not None), default=None)

    def ways_of_writer(self, writer: WriterSpec) -> frozenset[str]:
        """RPDO, SDO, or both."""
        spec = writer.by(CanopenWriter)
        return frozenset(way for way, has in ((_RPDO, spec.by_rpdo), (_SDO, spec.by_sdo)) if has)

    def ways_of_variable(self, variable: ExpandedVariable, cell: ExpandedCell) -> frozenset[str]:
        """RPDO where a PDO carries it, SDO wherever it is an object."""
        node = _node_of(cell)
        in_pdo = node is not None and variable.index in node.carried
        ways = ((_RPDO, in_pdo), (_SDO, in_pdo or variable.spec.by(CanopenPlaces).canopen is not None))
        return frozenset(way for way, has in ways if has)

    def writes_whole(
        self, writer: WriterSpec, variables: Sequence[ExpandedVariable], cell: ExpandedCell
    ) -> bool:
        """Whether all of them are in one PDO of the writer. SDO writes one at a time."""
        node = _node_of(cell)
        if node is None or not writer.by(CanopenWriter).by_rpdo:
            return False
        from gatewayd.links.canopen_node.expand import writes_by  # noqa: PLC0415 - see above

        wanted = {variable.index for variable in variables}
        return any(
            wanted <= {entry.variable for entry in pdo.entries}
            and writes_by(writer.by(CanopenWriter), pdo, cell)
            for pdo in node.pdos
        )

    def places_of(self, line: Part[VariableSpec], document: Document) -> bool:
        """Whether the line says so, or a PDO names it."""
        node = document.part(Canopen)
        pdos = node.spec.pdos.values() if node is not None else ()
        listed = (member.name for pdo in pdos for member in pdo.variables)
        return line.spec.by(CanopenPlaces).canopen is not None or line.name in listed

    def reaches(self, cell: ExpandedCell) -> Iterable[tuple[int, Reach]]:
        """What the objects show. A BOOLEAN is of bits only."""
        node = _node_of(cell)
        if node is None:
            return
        from gatewayd.canopen.datatypes import CanType  # noqa: PLC0415 - see above
        from gatewayd.links.canopen_values import reach_of  # noqa: PLC0415

        for placed in node.objects:
            if placed.plan.type is not CanType.BOOLEAN:
                yield placed.variable, reach_of(placed.plan.type, placed.plan.linear)

    def expand(self, document: Document, variables: Sequence[ExpandedVariable]) -> CanopenCell | None:
        """The node, laid out."""
        part = document.part(Canopen)
        if part is None:
            return None
        from gatewayd.links.canopen_node.expand import expand_canopen  # noqa: PLC0415 - see above

        return expand_canopen(part, variables)

    def bus_uses(self, cell: ExpandedCell) -> Iterable[BusUse]:
        """The node, with its PDOs and its heartbeat."""
        if _node_of(cell) is not None:
            from gatewayd.links.canopen_node.bus_load import bus_use  # noqa: PLC0415 - see above

            yield bus_use(cell)

    def compile(self, cell: ExpandedCell) -> CanopenPlan:
        """One node on one bus."""
        from gatewayd.links.canopen_node.compile import compile_canopen  # noqa: PLC0415 - see above

        node = _node_of(cell)
        assert node is not None
        return compile_canopen(cell, node)


def _node_of(cell: ExpandedCell) -> CanopenCell | None:
    return cast("CanopenCell | None", cell.links.get(KIND.key))


LANGUAGE: Final = CanopenLanguage()
