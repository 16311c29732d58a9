"""What the gateway says of itself as JSON: the one description that control socket, page and documentation share.

Fields are never renamed and never removed within version 1; new ones may come at any time. Each has its meaning beside
its type; docs/reference/control-api.md is made from that (`documented`). Objects of links stand at the keys of their
kinds, which say what is in them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, NotRequired, TypedDict, get_origin, get_type_hints

from gatewayd.links.registry import kinds

Json = dict[str, Any]


class VersionInfo(TypedDict):
    """Which gateway answers."""

    api: Annotated[int, "version of this interface, 1"]
    version: Annotated[str, "version of gatewayd"]
    pid: Annotated[int, "process id of the daemon"]


class LinkStatus(TypedDict):
    """One link in words, whatever its kind."""

    name: Annotated[str, "key of its section, and of its object in the cell"]
    title: Annotated[str, "what its kind is called"]
    address: Annotated[str, "where it is"]
    level: Annotated[str, "`good`, `warn`, `bad`, or `idle`: not there, and not missed yet"]
    words: Annotated[str, "why it has this level; its wording may change at any time"]
    detail: Annotated[str, "more of it, may be empty"]


class WriterStatus(TypedDict):
    """One declared writer."""

    name: Annotated[str, "name of the writer"]
    alive: Annotated[bool, "connected, and heard in time (`timeout`, `heartbeat`)"]
    connections: Annotated[int, "its open connections"]
    age: Annotated[float | None, "seconds since its last request, or null"]
    timeout: Annotated[float | None, "seconds without a request after which it counts as lost, or null"]
    locks: Annotated[int, "number of locks that it owns"]


class RefusalStatus(TypedDict):
    """A refused request."""

    variable: Annotated[str | None, "name of the variable, or null"]
    writer: Annotated[str | None, "name of the writer that was refused, or null if it is not declared"]
    holder: Annotated[str | None, "name of the owner that stood in the way, or null"]
    reason: Annotated[str | None, "why, in words"]
    age: Annotated[float | None, "seconds since then"]
    text: Annotated[str, "the refusal in one sentence"]


class UnservedStatus(TypedDict):
    """A request that nothing here serves."""

    writer: Annotated[str | None, "name of the writer that asked, or null if it is not declared"]
    peer: Annotated[str | None, "address of an undeclared peer, or null"]
    reason: Annotated[str | None, "why, in words"]
    age: Annotated[float | None, "seconds since then"]
    text: Annotated[str, "who asked for what, and what is here, in one sentence"]


class CellStatus(TypedDict):
    """One cell at a glance, but for the objects of its links."""

    name: Annotated[str, "name of the cell"]
    source: Annotated[str, "mapping file as it was named"]
    fingerprint: Annotated[str, "32 bits of the mapping's meaning, eight hexadecimal digits"]
    healthy: Annotated[
        bool,
        "robot fresh and writable, no problem of another link, every variable available, in range and as the "
        "robot has it, nothing forced, no writer lost",
    ]
    problems: Annotated[list[str], "list of texts: what makes it unhealthy"]
    links: Annotated[list[LinkStatus], "list of its links in words"]
    writers: Annotated[list[WriterStatus], "list of declared writers"]
    variables: Annotated[dict[str, int], "number of variables: `total`, and by quality as of a variable"]
    locks: Annotated[dict[str, int], "`total`, `owned`, `operator` (held by the local operator)"]
    writes: Annotated[dict[str, int], "requests `accepted` and `refused` since the start"]
    last_refusal: Annotated[RefusalStatus | None, "the last refused request, or null"]
    unserved: Annotated[
        dict[str, int],
        "requests that nothing here serves since the start, by reason: `no_such_unit`, `no_such_address`, "
        "`no_such_function`, `malformed`, `not_allowed`, `robot_lost`",
    ]
    last_unserved: Annotated[UnservedStatus | None, "the last of them, or null"]
    heartbeat: Annotated[int, "counts up every 100 ms"]
    gaps: Annotated[int, "times the gateway stood still, stopped, suspended or starved of the CPU"]


class Status(VersionInfo):
    """Everything at a glance."""

    time: Annotated[str, "when this was answered, UTC"]
    uptime: Annotated[float, "seconds since the first cell was served"]
    healthy: Annotated[bool, "no cell has a problem, and the gateway as a whole has none"]
    problems: Annotated[
        list[str], "list of texts: everything that makes it unhealthy, with the name of the cell in front"
    ]
    cells: Annotated[list[Json], "list of cells"]


class VariableDeclaration(TypedDict):
    """What the mapping says of one variable, but for its places on links."""

    cell: Annotated[str, "name of the cell"]
    number: Annotated[int, "as the status block counts it, from 1"]
    name: Annotated[str, "name of the variable"]
    direction: Annotated[str, "`input` (fieldbus to robot) or `output` (robot to fieldbus)"]
    kind: Annotated[str, "`bool`, `int` or `float`"]
    robot: Annotated[str, "what it is in the robot: `input_int_register_0`, `actual_TCP_pose[2]`"]
    unit: Annotated[str, "unit of the value, may be empty"]
    lock: Annotated[str | None, "name of the lock that guards it, or null (outputs)"]
    limits: Annotated[list[float] | None, "null, or lowest and highest value"]
    fallback: Annotated[
        object,
        "what is seen when owner (inputs) or robot (outputs) are lost: `clear`, `hold`, `exception` or a value",
    ]
    comment: Annotated[str, "comment of the mapping, may be empty"]
    meanings: Annotated[
        dict[str, str] | None,
        'what its numbers mean where they stand for states (`{"7": "running"}`; `"0"` and `"1"` of a bit), or null',
    ]
    bits: Annotated[
        dict[str, str] | None,
        'what each bit of its number says when it is 1 (`{"2": "protective stopped"}`), or null',
    ]


class VariableStatus(TypedDict):
    """One variable as it is now."""

    value: Annotated[object, "true or false, or a number in the robot's unit; the texts `nan`, `inf`, `-inf`"]
    quality: Annotated[
        str,
        "`good`, `stale`, `unavailable`, `never`, `forced`, `differs` (the robot holds something else), "
        "`out_of_range` (one of its places cannot show the value) or `not_running` (valid only while the program runs)",
    ]
    age: Annotated[float | None, "seconds since its source reported it, or null if it never did"]
    owner: Annotated[str | None, "name of the writer that owns it now, `operator`, or null"]
    lease: Annotated[float | None, "seconds of the owner's lease left, or null without an owner or end"]
    forced: Annotated[
        Json | None,
        "null, or `value` and `remaining` seconds of a force, and `reported` and `reported_quality`: what the robot "
        "reports of an output meanwhile, or reads back of an input (null where it does not), and `by` whom: a user of "
        "this machine, `token NAME`, or null",
    ]


class LockStatus(TypedDict):
    """One lock."""

    cell: Annotated[str, "name of the cell"]
    name: Annotated[str, "name of the lock: of its variable or group"]
    members: Annotated[list[str], "names of its variables"]
    owners: Annotated[list[str], "names of the writers that may own it, by priority where `takeover` is true"]
    takeover: Annotated[bool, "an earlier writer takes it from a later one"]
    declared_lease: Annotated[float | None, "seconds of lease, or null"]
    owner: Annotated[str | None, "name of the owner now, `operator`, or null"]
    remaining: Annotated[float | None, "seconds until the owner loses it without renewing, or null"]
    by: Annotated[
        str | None,
        "for whom the operator has it: a user of this machine, `token NAME`, several with commas; or null",
    ]


class EventMessage(TypedDict):
    """One event; fields that do not apply are left out."""

    seq: Annotated[int, "number of the event within its cell, from 1; ask for later ones with `after`"]
    time: Annotated[str, "when, UTC"]
    cell: Annotated[str, "name of the cell"]
    event: Annotated[str, "what: `robot lost`, `write refused` ... (all in the reference of the log)"]
    variable: NotRequired[Annotated[str, "name of the variable"]]
    lock: NotRequired[Annotated[str, "name of the lock"]]
    writer: NotRequired[
        Annotated[
            str,
            "name of the writer who did it or whom it happened to; `operator`, `undeclared` or `gateway`",
        ]
    ]
    other: NotRequired[Annotated[str, "former owner of a lock taken over, or holder in a refusal"]]
    reason: NotRequired[Annotated[str, "why it was refused, in words"]]
    peer: NotRequired[Annotated[str, "address of an undeclared peer"]]
    old: NotRequired[Annotated[object, "value before"]]
    new: NotRequired[Annotated[object, "value after, or refused"]]
    repeats: NotRequired[Annotated[int, "further refusals like this one, counted since the last one"]]
    request: NotRequired[Annotated[str, "what was asked for, in words, where no variable says it"]]
    detail: NotRequired[Annotated[str, "more, in words"]]
    text: Annotated[
        str,
        "all that in one sentence for people, values with their unit; its wording may change at any time",
    ]
    bad: Annotated[bool, "somebody should look at it"]


class AuditRecord(TypedDict):
    """One record of the audit; fields that do not apply are left out."""

    time: Annotated[str, "when, UTC; of merged changes, the last one's"]
    monotonic: Annotated[float, "seconds of the gateway's own clock; equal for all changes of one request"]
    cell: Annotated[str, "name of the cell"]
    what: Annotated[
        str,
        "`write accepted`, `write refused`, `lock acquired`, `lock taken over`, `lock released`, "
        "`fallback applied`, `image follows the robot`, `value forced`, `force ended`",
    ]
    writer: NotRequired[Annotated[str, "name of the writer; `operator`, `undeclared` or `gateway`"]]
    variable: NotRequired[Annotated[str, "name of the variable"]]
    lock: NotRequired[Annotated[str, "name of the lock"]]
    old: NotRequired[Annotated[object, "value before; of merged changes, before the first"]]
    new: NotRequired[Annotated[object, "value after, or refused; of merged changes, the last"]]
    times: NotRequired[Annotated[int, "changes or refusals that the record stands for, if more than one"]]
    holder: NotRequired[Annotated[str, "owner that stood in the way, or former owner"]]
    reason: NotRequired[Annotated[str, "why it was refused, in words"]]
    peer: NotRequired[Annotated[str, "address of an undeclared peer"]]
    request: NotRequired[Annotated[str, "what was asked for, in words, where no variable says it"]]
    detail: NotRequired[Annotated[str, "more, in words"]]
    text: NotRequired[
        Annotated[str, "all that in one sentence, as of an event; the audit's file does not have it"]
    ]
    bad: NotRequired[Annotated[bool, "somebody should look at it; not in the file either"]]


def taken_names(*, has_places: bool) -> frozenset[str]:
    """Names that no link may have: its object stands beside these fields of a cell.

    `has_places`: there is one beside those of each variable, too.
    """
    found = (CellStatus, VariableDeclaration, VariableStatus) if has_places else (CellStatus,)
    return frozenset(name for fields in found for name in _meanings(fields))


def documented() -> dict[str, Mapping[str, str]]:
    """Every object that the control interface answers, by name: its fields and what they mean."""
    return {
        "status": _meanings(Status),
        "cell": _cell(),
        "link": _meanings(LinkStatus),
        **{kind.key: kind.fields for kind in kinds() if kind.fields},
        "writer": _meanings(WriterStatus),
        "refusal": _meanings(RefusalStatus),
        "unserved": _meanings(UnservedStatus),
        "variable": _meanings(VariableDeclaration)
        | {kind.key: kind.place for kind in kinds() if kind.place}
        | _meanings(VariableStatus),
        "lock": _meanings(LockStatus),
        "event": _meanings(EventMessage),
        "audit": _meanings(AuditRecord),
        "version": _meanings(VersionInfo),
    }


def _cell() -> dict[str, str]:
    """With the objects of links behind the links."""
    found = {}
    for name, meaning in _meanings(CellStatus).items():
        found[name] = meaning
        if name == "links":
            found |= {kind.key: f"{kind.title}, or null" for kind in kinds()}
    return found


def _meanings(description: type) -> dict[str, str]:
    """Field -> meaning, in the order in which they are written."""
    found = {}
    for name, hint in get_type_hints(description, include_extras=True).items():
        annotated = hint.__args__[0] if get_origin(hint) is NotRequired else hint
        found[name] = str(annotated.__metadata__[0])
    return found
