"""What a kind of link has to say and do: the only thing that the rest of the gateway knows of Modbus or CANopen.

A kind is a package with three modules that load apart, because not everybody needs all of it:

- `declaration` (`KIND`): its key, how it describes a plan, what its status words and metrics are. Light; for everybody.
- `language` (`LANGUAGE`): its part of the mapping language, with rules. For `check`, `show` and the compiling process.
- `runtime` (`RUNTIME`): the link itself. For the daemon.

Everything has a default but for what makes the kind one. `gatewayd.links.registry` names the packages.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum, IntEnum
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Protocol

if TYPE_CHECKING:
    # A check, which has no use for a running cell, imports this module.
    from gatewayd.core.cell import Cell
    from gatewayd.core.definition import CellDefinition, Value
    from gatewayd.core.objection import Objection
    from gatewayd.core.requester import Requester
    from gatewayd.core.status_layout import LinkTable, StatusField
    from gatewayd.links.access import PlaceAnswer, PlaceRequest
    from gatewayd.mapping.plan import LinkPlan, Plan

# -- declaration -------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class LinkMetric:
    """A gauge or counter (`..._total`) with one sample for each link, whose cell is its label.

    A link that is not named as its kind has its name in one more label, `link`.
    """

    name: str
    figure: str
    """The figure of the link's health that has the value."""
    meaning: str
    label: str = ""
    """A further label; the figure is then a mapping from its values to numbers."""
    shared: tuple[str, str] | None = None
    """Of something that several cells share: a label in place of the cell, and the figure that says which it is."""

    @property
    def labels(self) -> tuple[str, ...]:
        """What its samples differ in."""
        first = self.shared[0] if self.shared is not None else "cell"
        return (first, self.label) if self.label else (first,)


@dataclass(frozen=True, slots=True)
class Place:
    """Where a link shows one variable."""

    text: str
    """For people, in one piece: `holding 100 (400101) int32`."""
    fields: Mapping[str, object]
    """For programs: the object that the control interface has of it (`LinkKind.place`)."""
    area: str
    """For the page: `holding`, `object`."""
    address: str
    """Within the area: `100`, `0.3`, `2010h:01`."""
    notation: str
    """The address as others spell it, or what else leads there: `400101`, `COB-ID 0x190`."""
    type: str


class Names(str):
    """A setting that is a list of names with blanks between them: what differs is shown name by name."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class Description:
    """A plan of a link in words. What is not set is missing; parts of a cell go by their names, never by index."""

    settings: Mapping[str, str] = field(default_factory=dict)
    """Fact -> text: two plans differ where these do, so every number that matters stands in one."""
    places: Mapping[int, Sequence[Place]] = field(default_factory=dict)
    """By index of the variable."""
    writers: Mapping[int, str] = field(default_factory=dict)
    """How the writer with this index is known."""
    meanings: Mapping[int, Mapping[int, str]] = field(default_factory=dict)
    """By index of the variable: what its numbers mean, where they stand for states (0 and 1 of a bit likewise)."""
    bits: Mapping[int, Mapping[int, str]] = field(default_factory=dict)
    """By index of the variable: what each bit of its number says when it is 1, where they stand for states."""
    address: str = ""
    """Where it is, in one piece: `127.0.0.1:502 unit 1`."""
    fields: Mapping[str, object] = field(default_factory=dict)
    """What the control interface says of the link besides its health: `{"listen": ..., "unit": ...}`."""


class LinkKind:
    """One kind of link: what everybody may know of it."""

    key: ClassVar[str]
    """Of its section, and of its places at variables and writers: `modbus`."""
    title: ClassVar[str]
    """For headlines: `Modbus TCP server`."""
    fields: ClassVar[Mapping[str, str]] = {}
    """Fields of its object in the status of the control interface, and what they mean."""
    place: ClassVar[str] = ""
    """What the control interface has of a variable at the key, in words; empty: its links have no places."""
    has_one_place: ClassVar[bool] = False
    """A variable has one place at most: the interface has that or null, not a list."""
    status_fields: ClassVar[tuple[StatusField, ...]] = ()
    """Words of the status block that its links report (`Cell.health.words`), at addresses that nobody else has."""
    status_tables: ClassVar[tuple[LinkTable, ...]] = ()
    """Tables of the status block that its links report (`Cell.health.tables`), behind those of the core."""
    metrics: ClassVar[tuple[LinkMetric, ...]] = ()
    traffic: ClassVar[str] = ""
    """Module whose `DECODER` makes what puts its links' traffic into words (`links.traffic`); empty: there is none."""
    exports: ClassVar[str] = ""
    """Module with `EXPORTS`, what is written of its links for other tools (`links.exports`); empty: nothing is."""
    doctor: ClassVar[str] = ""
    """Module whose `EXAMINATION` looks at what its links need, where they are to run (`links.examination`); empty:
    nothing is looked at.
    """
    access: ClassVar[str] = ""
    """Module whose `ACCESS` talks to devices of its kind where no gateway does (`links.access`); empty: there are none.
    """
    sheets: ClassVar[str] = ""
    """Module whose `SHEETS` proposes a mapping from a data sheet of its devices (`links.proposals`); empty: none does.
    """
    stands_by: ClassVar[bool] = False
    """Its links run while another gateway serves the cell, too: what comes from the robot is read, nobody is served."""
    decides: ClassVar[bool] = False
    """Its links are `DutyLink`s: they decide whether this gateway serves the cell. One a cell at most."""
    usual: ClassVar[bool] = False
    """Nearly every cell has one: its runtime is imported while the mapping files are read."""

    def describe(self, plan: LinkPlan, cell: CellDefinition) -> Description:
        """The plan in words."""
        raise NotImplementedError

    def fits(self, old: LinkPlan, new: LinkPlan, before: CellDefinition, after: CellDefinition) -> bool:
        """Whether a running link can go on with another plan (`Link.rebind`). Asked before anything moves.

        `old` is what the link works with (`Link.plan`), which may be more than the mapping asks for.
        """
        return False

    def moved(self, old: LinkPlan, new: LinkPlan) -> bool:
        """Of the link that brings the values: whether it would have another robot.

        What the present one was given ends then, and nobody commands the other before it was asked to.
        """
        return False

    def disturbs(
        self, old: LinkPlan, new: LinkPlan, before: CellDefinition, after: CellDefinition
    ) -> Iterable[Objection]:
        """What else must not happen unasked. Owners that would lose their way are not its matter: `Link.departing`."""
        return ()


# -- traffic ------------------------------------------------------------------------------------------------------
# What passes a link, while somebody traces. A link hands its tap the raw bytes; words are made by whoever reads the
# trace, in another process, so that a trace costs the gateway as little as can be. Without one it costs nothing.


@dataclass(frozen=True, slots=True)
class Passage:
    """One frame, or one piece of a stream."""

    time: float
    """Monotonic seconds."""
    data: bytes
    """As `TrafficDecoder.medium` has it."""
    outgoing: bool
    """The gateway sent it."""
    peer: str = ""
    """Address and port of the other end; empty on a bus."""
    own: str = ""
    """Address and port of our end; on a bus the name of the interface."""
    cell: str | None = ""
    """Of a part that several cells share: the cell that it concerns; None: none, or any. Empty: that of the link."""
    links: tuple[str, ...] = ()
    """Of a part that several links of a kind share: the names of those that it concerns. Empty: that of the part."""


Tap = Callable[[Passage], None]
"""Takes what passes. It must not raise, and never waits."""


TapOf = Callable[[str, str, str], Tap]
"""The tap for a link: cell (empty where several share it), name, and key of the kind. The same one for the same."""


class Medium(Enum):
    """How bytes are carried, so that a file for other tools can be written."""

    CAN = "can"
    """One frame as SocketCAN has it: big-endian identifier with flags, length, 3 bytes, 8 bytes of data."""
    TCP_SERVER = "tcp server"
    """Bytes of a TCP connection that the peer has opened."""
    TCP_CLIENT = "tcp client"
    """Bytes of a TCP connection that the gateway has opened."""
    OTHER = "other"
    """No file of other tools has it."""


class TrafficDecoder:
    """Puts what passed the links of one kind into words. May remember: requests, for their answers."""

    medium: ClassVar[Medium] = Medium.OTHER
    port: ClassVar[int] = 0
    """Port of the server by which other tools know the protocol."""

    def words(self, data: bytes, peer: str, *, outgoing: bool) -> str:
        """One passage in words, on one line. Never raises, whatever the bytes are."""
        return f"length {len(data)}: {data[:16].hex(' ')}" + (" ..." if len(data) > 16 else "")


@dataclass(frozen=True, slots=True)
class PackageLayout:
    """What the packages of a robot have, the same for all of one session."""

    robot: str
    """Its address and software, for people."""
    names: tuple[str, ...]
    """Fields in their order."""
    types: tuple[str, ...]
    """Their types, as the controller spells them."""
    period: float
    """Seconds between two packages."""
    pack: Callable[[Sequence[Value]], bytes]
    """The bytes of a package, big-endian and without gaps, of its flat values."""


class PackageTap(Protocol):
    """Takes every package of a robot, while somebody records. Must not raise, and never waits."""

    def begin(self, layout: PackageLayout) -> None:
        """A session has begun, or was there already; packages of this layout follow."""

    def package(self, values: Sequence[Value], time: float) -> None:
        """A package, flat, received at `time` (monotonic seconds)."""

    def lost(self, reason: str) -> None:
        """The session has ended, for this reason in words."""


# -- runtime -----------------------------------------------------------------------------------------------------


class Level(IntEnum):
    """How a part of the picture is: idle things are grey, the others green, yellow and red."""

    IDLE = 0
    GOOD = 1
    WARN = 2
    BAD = 3


@dataclass(frozen=True, slots=True)
class LinkHealth:
    """How a link is at this moment."""

    name: str = ""
    """For headlines: `Modbus 127.0.0.1:502`, `CAN can0`."""
    level: Level = Level.GOOD
    words: str = ""
    """Its state in a few words: `listening`, `bus-off`."""
    detail: str = ""
    """More of it: `2 connections`."""
    problems: tuple[str, ...] = ()
    """What keeps the cell from being well, each in words with cause and remedy."""
    figures: Mapping[str, object] = field(default_factory=dict)
    """By name, for the control interface (`LinkKind.fields`) and metrics."""


class Link:
    """One connection to the outside of one cell."""

    title: ClassVar[str]
    """In the log, before the name of the cell: `robot link`."""
    plan: LinkPlan
    """What it works with."""

    @property
    def progress(self) -> int | None:
        """Moves while `run` works, whatever the other side does; 0: it has not begun. For the watchdog.

        None: the link has no work of its own, what it shares with others does it.
        """
        return None

    @property
    def reachable(self) -> bool | None:
        """Whether a writer can reach the cell by it now; None: no writer ever comes this way."""
        return None

    @property
    def settled(self) -> bool:
        """False while it is about to know more: a reload waits a little."""
        return True

    async def run(self) -> None:
        """Work until cancelled."""

    def gap(self, since: float, now: float) -> None:
        """The process stood still from `since` to `now`; called before anything that waited is served."""

    def departing(self, plan: LinkPlan | None, after: CellDefinition) -> Mapping[Requester, str]:
        """Who writes by it now and would not be the same writer any more if it went on with `plan`, and why.

        `after`: the cell of that plan; None: the link ends. Changes nothing: it is asked for objections.
        """
        return {}

    def release(self, plan: LinkPlan | None, after: CellDefinition, now: float) -> None:
        """These are lost at once, in the old cell, before there is a new one: nobody inherits what they own."""

    def rebind(self, plan: LinkPlan, cell: Cell, now: float) -> None:
        """Go on with another plan and the successor of the cell; only where `LinkKind.fits` said so."""
        raise NotImplementedError

    def flush(self, now: float) -> None:
        """Send at once what is due."""

    async def close(self) -> None:
        """Send what is still due; `run` is cancelled afterwards."""

    def trace(self, tap: Tap | None) -> None:
        """Hand `tap` what passes from now on; None: nobody traces any more. Called again and again with the same."""

    async def ask(self, request: PlaceRequest) -> PlaceAnswer:
        """Read or write a place of the device at the other end, by hand; only links of kinds with `access` are asked.

        Raises `links.access.AccessError`.
        """
        raise NotImplementedError

    def health(self) -> LinkHealth:
        """How it is now."""
        return LinkHealth()


class SourceLink(Link):
    """The link that brings the values of a cell and takes what is written: every cell has exactly one.

    Its losses are the cell's (`Cell.robot_lost`), and freshness is about it.
    """

    sent_listeners: list[Callable[[], None]]
    """Called after something that was written has been sent. They must not raise."""

    @property
    def claim(self) -> Claim:
        """How its claim stands."""
        return Claim.HELD

    def ask_claim(self) -> None:
        """Ask for the claim once, where it is made on request; no effect while an answer is due."""

    def withdraw_claim(self, why: str, now: float) -> None:
        """Give the claim back: nothing is sent any more, and it is not asked for again before `ask_claim`."""

    def read_back(self, variable: int) -> Value | None:
        """What the other side holds of an input, as it said last in this session; None: it does not say so."""
        return None

    def tap_packages(self, tap: PackageTap | None) -> None:
        """Hand `tap` every package from now on; None: nobody records any more. Called again and again with the same."""


class Claim(Enum):
    """How the claim of a source link stands to what it writes to."""

    NO_SESSION = "no session"
    UNASKED = "unasked"
    ASKED = "asked"
    HELD = "held"
    """Ours, and what it holds was read: the cell can be written."""
    PARTIAL = "partial"
    """Some of it, without the part that decides: somebody else has that."""
    REFUSED = "refused"
    """Somebody else has it."""


@dataclass(frozen=True, slots=True)
class Duty:
    """What a cell has to do at this moment, as its `DutyLink` has decided."""

    serve: bool
    """Run all of its links; else only those of kinds that `stands_by`."""
    ask: bool = False
    """Ask for the claim once."""
    withdraw: bool = False
    """Give the claim back."""
    why: str = ""
    """In words, where it is not served: by whom it is, or what is waited for."""


class DutyLink(Link):
    """The link that decides whether this gateway serves its cell, or stands by while another one does."""

    def duty(self, claim: Claim, now: float) -> Duty:
        """What to do now; asked again and again, at least every 20 ms."""
        raise NotImplementedError

    def hand_over(self, now: float) -> str:
        """Leave the cell to the other gateway; why that cannot be, or empty: it has begun."""
        raise NotImplementedError


class PrepareError(OSError):
    """Something that several cells use cannot be had; the text says what and why."""


class Prepared(Protocol):
    """What a shared part needs for other plans, ready and not in use yet."""

    def commit(self) -> None:
        """Have it in use by the next `SharedPart.serve`. Cannot fail."""

    async def abort(self) -> None:
        """Give it back; nothing has changed."""


class SharedPart:
    """What the links of one kind use together in all cells: listeners."""

    async def run(self) -> None:
        """Work until cancelled; what cannot be had yet is tried again."""
        raise NotImplementedError

    def progress(self) -> Mapping[str, int]:
        """A counter for each thing that has to go on, by its name for the log; 0: it has not begun."""
        return {}

    def troubles(self) -> Sequence[str]:
        """What concerns the gateway as a whole, in a few words each."""
        return ()

    def gap(self, since: float, now: float) -> None:
        """The process stood still from `since` to `now`; called before anything that waited is served."""

    def trace(self, tap: Tap | None) -> None:
        """See `Link.trace`: of what passes this part and not a link of one cell."""

    async def refresh(self) -> Sequence[str]:
        """A reload was asked for: look at files beside the mapping; returns what is wrong with them."""
        return ()

    async def prepare(self, plans: Sequence[Plan]) -> Prepared:
        """Have ready what these plans need besides what there is. Raises PrepareError."""
        raise NotImplementedError

    def disturbs(self, plans: Sequence[Plan]) -> Iterable[tuple[Cell, Objection]]:
        """What other plans would take from who uses it, each with the cell that it concerns. Changes nothing.

        A cell may lose something here though its own plan stays as it is: another one comes beside it.
        """
        return ()

    def serve(self, links: Sequence[Link], successors: Mapping[Cell, Cell]) -> None:
        """Serve these links from now on, and no others. `successors` are cells that took the place of another one."""
        raise NotImplementedError

    async def close(self) -> None:
        """Take nothing more: nobody writes afterwards."""


@dataclass(frozen=True, slots=True)
class Context:
    """What a link is made with, besides plan and cell."""

    now: float
    state: Path
    """Directory of what is kept across restarts."""
    shared: SharedPart | None = None
    """What the kind shares, as `LinkRuntime.share` made it."""
    on_request: bool = False
    """Of a source link: it claims nothing before `SourceLink.ask_claim`: another gateway may be at work."""
    former: Link | None = None
    """The link of this name, maybe of another kind, whose `run` has ended or will have before this one's begins."""


class LinkRuntime:
    """Makes links of one kind."""

    def share(self) -> SharedPart | None:
        """What all links of the kind use together; made once for a daemon."""
        return None

    def make(self, plan: LinkPlan, cell: Cell, context: Context) -> Link:
        """A link that does nothing before its `run`."""
        raise NotImplementedError
