"""What a kind of link adds to the mapping language: the part of the contract for `check`, `show` and the compiler.

Everything has a default but for what makes the kind one. What the language, its rules and its tables want to know of a
link they ask here; they name none.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from gatewayd.mapping.diagnostics import Diagnostic, Position, Related
from gatewayd.mapping.document import Document, Part
from gatewayd.mapping.expanded import CellSettings, Defined, ExpandedCell, ExpandedLink, ExpandedVariable
from gatewayd.mapping.model import VariableSpec, WriterSpec
from gatewayd.mapping.plan import LinkPlan
from gatewayd.mapping.reach import Reach
from gatewayd.mapping.section import Section

if TYPE_CHECKING:
    from gatewayd.links.can_buses import BusUse


@dataclass(frozen=True, slots=True)
class WriterName:
    """A place in a link's section that names a writer."""

    name: str
    position: Position
    role: str
    """What the writer is there: `a writer that the watchdog requires`."""
    no_any: str = ""
    """What is wrong with `any` there; empty: nothing."""
    whole: Position | None = None
    """Where to say so: the place of all names."""


@dataclass(frozen=True, slots=True)
class Patience:
    """Something in the plant that acts when it has heard nothing of the gateway for a while."""

    what: str
    """What it does: `the robot program stops`."""
    seconds: float
    """How long it waits at least after the last moment at which the gateway was there."""
    position: Position
    """Where the mapping says so."""
    remedy: str
    """How it waits longer, in the imperative."""


class LinkLanguage:
    """One kind's sections, places, writers' keys, expansion, compilation and rules."""

    # -- what it is called -------------------------------------------------------------------------------------------

    key: ClassVar[str]
    """Of the kind: the key of its section, and of its places at variables and writers."""
    section_key: ClassVar[str] = ""
    """Of its section in the file, where that is another one than `key`; see `top_key`."""
    section: ClassVar[type[Section] | None]
    """The table at the top of the file; of a kind with `several` links, each table in it. None: its links are declared
    inside the section of another kind, and `compile_links` makes them."""
    several: ClassVar[bool] = False
    """Whether its section is a table of names, each with a table of its own. A valid one is no part in
    `Document.sections`, but one of `Document.named`; each makes a link of that name (`compile_links`)."""
    meaning: ClassVar[str] = ""
    """What the section is, for editors: `the Modbus TCP server`."""
    required: ClassVar[bool] = False
    defines: ClassVar[bool] = False
    """Whether it is a `DefiningLanguage`."""
    counts_absent: ClassVar[bool] = False
    """Whether a cell without the section has the fingerprint of one whose link is null: so it was from the first."""
    variable_keys: ClassVar[type[Section] | None] = None
    """Keys that a variable has by this kind, before those of the language: where it is."""
    variable_policies: ClassVar[type[Section] | None] = None
    """Keys of a variable by this kind that come after those."""
    writer_keys: ClassVar[type[Section] | None] = None
    """Keys that a writer has by this kind; the one called `key` says how it is known."""
    writer_also_by: ClassVar[tuple[str, ...]] = ()
    """Other keys of a writer that say, without that one, how it is known."""
    rules: ClassVar[tuple[str, ...]] = ()
    """Modules whose import enters the kind's rules."""
    tables: ClassVar[str] = ""
    """Module with `TABLES`, the kind's `LinkTables`, for `show`."""

    @property
    def top_key(self) -> str:
        """The key of its section in the file."""
        return self.section_key or self.key

    def concerns(self, document: Document) -> bool:
        """Whether the file says anything of this kind of link. Where it does not, none of the kind's rules is asked."""
        if self.required or document.has(self.top_key):
            return True
        lines = (self._keys_of(self.variable_keys, self.variable_policies), document.variables)
        writers = (self._keys_of(self.writer_keys), document.writers)
        return any(
            not keys.isdisjoint(part.spec.model_fields_set)
            for keys, parts in (lines, writers)
            for part in parts.values()
        )

    @staticmethod
    def _keys_of(*tables: type[Section] | None) -> frozenset[str]:
        return frozenset(key for table in tables if table is not None for key in table.model_fields)

    def adopt_for(self, document: Document) -> Iterable[float | None]:
        """How long adopted inputs wait for an owner, where the kind has a say in it; empty: it has none."""
        return ()

    def patience(self, document: Document) -> Iterable[Patience]:
        """What in the plant waits for the gateway, and for how long."""
        return ()

    # -- findings about its sections ---------------------------------------------------------------------------------

    nested: ClassVar[Mapping[tuple[type[Section], str], type[Section]]] = {}
    """Sections inside sections, by the first step of the path that leads there."""
    articles: ClassVar[Mapping[type[Section], str]] = {}
    """What its sections are called in a finding: `the section \\`modbus\\``."""
    places: ClassVar[tuple[type[Section], ...]] = ()
    """Sections inside a variable, beside whose keys those of the variable are expected."""
    telling_keys: ClassVar[tuple[str, ...]] = ()
    """Keys of its section that are seen at the top of the file."""
    elsewhere: ClassVar[Mapping[tuple[type[Section], str], str]] = {}
    """Hints for keys that people write into the wrong section."""
    synonyms: ClassVar[Mapping[tuple[str, str], str]] = {}
    """(key, word in capitals) -> what the word is called here."""
    output_policies: ClassVar[Mapping[str, str]] = {}
    """Keys of a variable that never act on an input -> what they say."""

    def broken(self, part: Part[Section]) -> Iterable[Diagnostic]:
        """What is wrong with its section although all of its values are valid; the section is left out then."""
        return ()

    def without_effect(self, document: Document) -> Iterable[tuple[Position, str, str]]:
        """Keys of its section that nothing in the file lets act: place, what is wrong, and the remedy."""
        return ()

    def names_writers(self, document: Document) -> Iterable[WriterName]:
        """Places of its section that name writers."""
        return ()

    # -- writers -----------------------------------------------------------------------------------------------------

    commands: ClassVar[bool] = False
    """Whether who writes by this kind means each value that it writes, so that it may give commands
    (`core.commands`)."""
    writer_example: ClassVar[str] = ""
    """How a writer is made known: `modbus: 192.0.2.20`."""
    way: ClassVar[str] = ""
    """What people call writing by this kind, where it is only one service; empty: as its key."""
    supervision_example: ClassVar[str] = ""
    """How it is supervised by this kind: `node: 1, heartbeat: 1s`; empty: by `timeout` only."""
    lost_by: ClassVar[str] = ""
    """How its writers are lost, where they have no connection that could end."""

    def knows(self, writer: WriterSpec) -> bool:
        """Whether the writer can write by this kind of link."""
        return False

    def names(self, writer: WriterSpec) -> Sequence[str]:
        """How the writer is known, in words: `192.0.2.20`, `RPDO, heartbeat of node 1`."""
        return ()

    def silence(self, writer: WriterSpec) -> float | None:
        """Seconds without a sign of life of its own (not a request) after which the writer is lost by this kind."""
        return None

    def supervises(self, writer: WriterSpec) -> bool:
        """Whether the writer is noticed by this kind when it hangs."""
        return self.silence(writer) is not None

    def ways_of_writer(self, writer: WriterSpec) -> frozenset[str]:
        """Services by which the writer writes, as people call them."""
        return frozenset({self.way or self.key} if self.knows(writer) else ())

    def ways_of_variable(self, variable: ExpandedVariable, cell: ExpandedCell) -> frozenset[str]:
        """Services by which the variable can be written."""
        return frozenset({self.way or self.key} if self.places_of(variable.part, cell.document) else ())

    def writes_whole(
        self, writer: WriterSpec, variables: Sequence[ExpandedVariable], cell: ExpandedCell
    ) -> bool:
        """Whether one request of the writer can write all of these."""
        return False

    def apart(self, variables: Sequence[ExpandedVariable], cell: ExpandedCell) -> Related | None:
        """Which of these lies too far from the others for one request."""
        return None

    # -- variables ---------------------------------------------------------------------------------------------------

    place_example: ClassVar[str] = ""
    """How a variable gets a place: `modbus: N`."""

    def places_of(self, line: Part[VariableSpec], document: Document) -> bool:
        """Whether a line of the file has a place by this kind."""
        return False

    def more_places(self, variable: ExpandedVariable) -> str:
        """How one variable gets several places by this kind; empty: it does not."""
        return ""

    def reaches(self, cell: ExpandedCell) -> Iterable[tuple[int, Reach]]:
        """Which values its places show, by index of the variable; places that show all need not be named."""
        return ()

    # -- what it shares with other kinds -------------------------------------------------------------------------

    def bus_uses(self, cell: ExpandedCell) -> Iterable[BusUse]:
        """What it puts on CAN buses on which other kinds of links may be as well."""
        return ()

    # -- from the file to the plan -----------------------------------------------------------------------------------

    def expand(self, document: Document, variables: Sequence[ExpandedVariable]) -> ExpandedLink | None:
        """The kind's side of a cell, laid out; None: it has none. Never raises, whatever valid parts there are."""
        return None

    def compile(self, cell: ExpandedCell) -> LinkPlan:
        """The plan of a cell without errors that has the section."""
        raise NotImplementedError

    def compile_links(self, cell: ExpandedCell) -> Mapping[str, LinkPlan]:
        """The plans of a cell without errors by the names of their links; no other kind has links of these names."""
        return {self.key: self.compile(cell)} if self.key in cell.document.sections else {}


class DefiningLanguage(LinkLanguage):
    """The language of the one kind that defines variables: their range, type and direction."""

    defines = True
    unwritten: ClassVar[Mapping[str, object]] = {}
    """Fields of `CellDefinition` -> what they are where the file says nothing, if not the core's default."""

    def define(self, line: Part[VariableSpec], document: Document) -> tuple[Sequence[Defined], bool]:
        """The values that a line names, in order, and whether they are a family. Raises UndefinedError."""
        raise NotImplementedError

    def named(self, line: Part[VariableSpec]) -> str:
        """What a line names, as written."""
        raise NotImplementedError

    def settings(self, document: Document) -> CellSettings:
        """What its section says of the cell."""
        raise NotImplementedError
