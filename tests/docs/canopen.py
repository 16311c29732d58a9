"""The parts of docs/ about CANopen that are made from the code; `generated` puts them into their pages."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterable, Mapping
from enum import Enum
from pathlib import Path

from gatewayd.canopen.bus import BusState
from gatewayd.canopen.cob_ids import Function
from gatewayd.canopen.dictionary import Entry, Object, Pdo
from gatewayd.canopen.emergency import ErrorCode, register_of
from gatewayd.canopen.identity import REACTIONS
from gatewayd.canopen.load import frame_bits
from gatewayd.canopen.lss import Command
from gatewayd.canopen.nmt import ALLOWED, NmtState, Service
from gatewayd.core.refusal import Reason
from gatewayd.core.status_layout import TABLES
from gatewayd.links.canopen_node.bus_load import BIT_RATES
from gatewayd.links.canopen_node.communication_errors import DOUBLED_TIME, OVERRUN_TIME
from gatewayd.links.canopen_node.eds import objects_of
from gatewayd.links.canopen_node.pdo_table import load_by_bit_rate, pdo_rows
from gatewayd.links.canopen_node.plan import CanopenPlan, canopen_of
from gatewayd.links.canopen_node.robot_errors import QUIET
from gatewayd.links.canopen_node.status_words import HEADER, TABLE_INDICES
from gatewayd.links.canopen_node.variables import ABORT_OF
from gatewayd.links.registry import status_fields
from gatewayd.mapping.loader import load

_NODE = Path(__file__).parents[2] / "gatewayd" / "links" / "canopen_node"


def table(head: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """A Markdown table."""
    lines = ["| " + " | ".join(head) + " |"]
    lines.append("|" + "---|" * len(lines[0].split(" | ")))
    lines += ["| " + " | ".join(str(value).replace("|", "\\|") for value in row) + " |" for row in rows]
    return "\n".join(lines)


def _docstring_table(module: str) -> str:
    """The table in the docstring of a module."""
    text = ast.get_docstring(ast.parse((_NODE / module).read_text())) or ""
    return "\n".join(line for line in text.splitlines() if line.startswith("|"))


# -- object dictionary ------------------------------------------------------------------------------------------------

_SAMPLE = b"""\
gatewayd: 1
cell: sample
robot: {host: robot}
canopen: {channel: can0, bitrate: 500000, node: 1}
writers: {line: {canopen: any}}
variables:
  start: {robot: input_bit_register_0, canopen: auto, owner: line}
  ready: {robot: output_bit_register_0, canopen: auto}
"""

_MEANINGS: Mapping[int, str | Mapping[int, str]] = {
    0x1000: "0: no device profile",
    0x1001: "bit 0 any error, bit 4 communication, bit 7 manufacturer's (a refused RPDO, the robot)",
    0x1002: "the flags of the status block, as 5F00h:02",
    0x1003: {
        0: "number of errors; write 0 to clear them",
        1: "EMCY codes, the newest first; high word: bytes 4-5 of the EMCY",
    },
    0x1005: "COB-ID of SYNC; bit 30: this node sends it",
    0x1006: "period of SYNC in microseconds; needed to send it",
    0x1007: "microseconds after SYNC within which synchronous RPDOs are accepted; 0: always",
    0x1008: "`gatewayd`",
    0x1009: "`none`",
    0x100A: "version of gatewayd",
    0x100C: "milliseconds between two remote frames of a guarding master; 0: no life guarding",
    0x100D: "number of guard times that may pass without one",
    0x1010: "write `save` to store changes; not while OPERATIONAL",
    0x1011: "write `load` to delete them; takes effect with the next reset; not while OPERATIONAL",
    0x1012: "COB-ID of TIME; bit 31: it is received, for the log",
    0x1014: "COB-ID of EMCY; bit 31: it is not sent",
    0x1015: "minimum time between two EMCYs in 0.1 ms",
    0x1016: "a node whose heartbeat is supervised: bits 16-22 its node-ID, bits 0-15 milliseconds; "
    "may shorten the time in the mapping, not lengthen it",
    0x1017: "milliseconds between two heartbeats; 0: none, and guarding is answered",
    0x1018: {
        1: "0: none assigned by CiA",
        2: "47574401h by default",
        3: "by default the release: major in the high word, minor in the low one",
        4: "by default derived from the name of the cell",
    },
    0x1019: "maximum of the counter in SYNC; 0: no counter",
    0x1029: "after a communication error: 0 PRE-OPERATIONAL if it was OPERATIONAL, 1 nothing, 2 STOPPED",
    0x1200: {1: "600h + node-ID", 2: "580h + node-ID"},
}
_PDO_MEANINGS: Mapping[int, Mapping[int, str]] = {
    0x1400: {
        1: "bit 31: not used; to change it, first set bit 31",
        2: "0-240 with the next SYNC, 254 and 255 at once",
        5: "deadline in milliseconds: EMCY 8250h, and the writer is lost; 0: none",
    },
    0x1600: {
        0: "number of entries; 0 while they are changed",
        1: "index, sub-index, length in bits; 00020008h and so on skip bits",
    },
    0x1800: {
        1: "bit 31: not used; to change it, first set bit 31",
        2: "0 with SYNC after a change, 1-240 every n-th SYNC, 254 and 255 when it changes",
        3: "minimum time between two of them in 0.1 ms; changed while bit 31 is set",
        5: "maximum time between two of them in ms; 0: no limit",
        6: "counter of the SYNC that counts as the first; 0: any; changed while bit 31 is set",
    },
    0x1A00: {0: "number of entries; 0 while they are changed", 1: "index, sub-index, length in bits"},
}
_PDO_NAMES = {
    0x1400: ("1400h-15FFh", "RPDO communication parameter"),
    0x1600: ("1600h-17FFh", "RPDO mapping parameter"),
    0x1800: ("1800h-19FFh", "TPDO communication parameter"),
    0x1A00: ("1A00h-1BFFh", "TPDO mapping parameter"),
}
_COLUMNS = ("index", "sub", "name", "type", "access", "stored", "meaning")


def _sample() -> tuple[Object, ...]:
    plan = load(_SAMPLE, "sample").plan
    assert plan is not None
    assert canopen_of(plan) is not None
    return tuple(objects_of(plan.the(CanopenPlan), plan.cell))


def communication_objects() -> str:
    """Every object of the communication area."""
    rows: list[tuple[object, ...]] = []
    for one in _sample():
        if one.index in _MEANINGS:
            meanings = _MEANINGS[one.index]
            first = one.entries[min(1, len(one.entries) - 1)].subindex
            rows.extend(_rows(one, {first: meanings} if isinstance(meanings, str) else meanings))
        elif one.index in _PDO_MEANINGS:
            rows.extend(_pdo_rows(one))
        else:
            known = one.index >= 0x2000 or one.index & ~0x1FF in _PDO_MEANINGS
            assert known, f"{one.index:04X}h has no meaning"
    return table(_COLUMNS, rows)


def _rows(one: Object, meanings: Mapping[int, str]) -> Iterable[tuple[object, ...]]:
    index = f"{one.index:04X}h"
    for entry in one.entries:
        last = one.entries[-1].subindex
        is_row = re.search(r" \d+$", entry.name) is not None
        if is_row and entry.subindex > 1:
            continue
        sub = f"1-{last}" if is_row else f"{entry.subindex:X}"
        name = re.sub(r" \d+$", "", entry.name) if is_row else entry.name
        title = f"{one.name}: {name.lower()}" if last and entry.subindex == 0 else name
        yield (index, sub, title, *_facts(entry), meanings.get(entry.subindex, ""))
        index = ""


def _pdo_rows(one: Object) -> Iterable[tuple[object, ...]]:
    indices, name = _PDO_NAMES[one.index]
    meanings = _PDO_MEANINGS[one.index]
    for entry in one.entries:
        if entry.name.startswith("Mapped object") and entry.subindex > 1:
            continue
        sub = "1-40" if entry.name.startswith("Mapped object") else f"{entry.subindex:X}"
        shown = re.sub(r" 1$", "", entry.name)
        title = f"{name}: {shown.lower()}" if entry.subindex == 0 else shown
        yield (
            indices if entry.subindex == 0 else "",
            sub,
            title,
            *_facts(entry),
            meanings.get(entry.subindex, ""),
        )


def _facts(entry: Entry) -> tuple[str, str, str]:
    return entry.type.name, entry.access.value, "yes" if entry.stored else ""


def status_objects() -> str:
    """The status block as objects."""
    by_index = {one.index: one for one in _sample()}
    header = by_index[HEADER]
    rows: list[tuple[object, ...]] = []
    for entry, field in zip(header.entries[1:], status_fields(), strict=True):
        assert entry.name == field.name
        rows.append(
            (f"{HEADER:04X}h", f"{entry.subindex:02X}", f"`{entry.name}`", *_facts(entry)[:2], field.meaning)
        )
    for one in TABLES:
        index = TABLE_INDICES[one.name]
        entry = by_index[index].entries[1]
        meaning = one.meaning.replace("one word", "one entry")
        rows.append((f"{index:04X}h", "01-FE", f"`{one.name}`", *_facts(entry)[:2], meaning))
    return table(("index", "sub", "name", "type", "access", "meaning"), rows)


# -- services ---------------------------------------------------------------------------------------------------------


def nmt_services() -> str:
    """Which service runs in which NMT state."""
    states = (NmtState.INITIALISING, NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL, NmtState.STOPPED)
    head = ("service", *(f"{state.name} ({state.value})" for state in states))
    rows = [
        (service.value, *("yes" if service in ALLOWED[state] else "-" for state in states))
        for service in Service
    ]
    return table(head, rows)


def connection_set() -> str:
    """The COB-IDs of a node."""
    fixed = {Function.NMT, Function.SYNC, Function.TIME, Function.LSS_REQUEST, Function.LSS_RESPONSE}
    words = {
        Function.NMT: ("NMT command", "to the node"),
        Function.SYNC: ("SYNC", "1005h"),
        Function.TIME: ("TIME", "1012h"),
        Function.TPDO1: ("TPDO 1 to 4, each 100h higher", "1800h-1803h"),
        Function.RPDO1: ("RPDO 1 to 4, each 100h higher", "1400h-1403h"),
        Function.SDO_RESPONSE: ("SDO answer", "1200h"),
        Function.SDO_REQUEST: ("SDO request", "1200h"),
        Function.ERROR_CONTROL: ("boot-up, heartbeat, guarding", "1017h"),
        Function.LSS_RESPONSE: ("LSS answer", ""),
        Function.LSS_REQUEST: ("LSS request", ""),
    }
    rows: list[tuple[object, ...]] = [(f"{Function.EMCY.value:03X}h + node-ID", "EMCY", "1014h")]
    rows += [(f"{one.value:03X}h" + ("" if one in fixed else " + node-ID"), *words[one]) for one in Function]
    return table(("COB-ID", "what", "object"), sorted(rows, key=str))


_ERRORS: Mapping[ErrorCode, str] = {
    ErrorCode.NONE: "the last active error is cleared",
    ErrorCode.STORED_PARAMETERS: "the stored parameters cannot be read; defaults are used",
    ErrorCode.OVERRUN: "received frames were lost because the buffer was full",
    ErrorCode.PASSIVE: "the controller is error-passive",
    ErrorCode.HEARTBEAT: "the heartbeat of a node of 1016h, or the guarding, is missing (byte 4: the node-ID)",
    ErrorCode.BUS_OFF_RECOVERED: "the controller was off the bus and is back",
    ErrorCode.PDO_TOO_SHORT: "an RPDO was shorter than its mapping and was dropped (bytes 4-5: its number)",
    ErrorCode.PDO_TOO_LONG: "an RPDO was longer than its mapping; its first bytes were used",
    ErrorCode.SYNC_LENGTH: "SYNC has another length than 1019h says (byte 4: the length)",
    ErrorCode.COB_ID_COLLISION: "another node on the bus has the node-ID of this one",
    ErrorCode.RPDO_TIMEOUT: "an RPDO did not arrive within its deadline; the RPDO writer is lost",
    ErrorCode.WRITE_HELD: "an RPDO was dropped: another writer owns a variable of it",
    ErrorCode.WRITE_OUT_OF_LIMITS: "an RPDO was dropped: a value is out of limits",
    ErrorCode.WRITE_ROBOT_LOST: "an RPDO was dropped: the robot is not connected",
    ErrorCode.WRITE_CLAIMED_ELSEWHERE: "an RPDO was dropped: the controller gave a register to another client",
    ErrorCode.WRITE_NEVER: "an RPDO was dropped: this writer may never write a variable of it",
    ErrorCode.WRITE_HEARTBEAT_LOST: "an RPDO was dropped: the heartbeat that its writer promised is missing",
    ErrorCode.WRITE_PARTIAL_TAKEOVER: "an RPDO was dropped: it would take over part of a `whole` group",
    ErrorCode.ROBOT_LOST: "the robot is not connected",
    ErrorCode.ROBOT_STALE: "the robot is connected, but its values are stale (byte 4: `robot_state`)",
    ErrorCode.ROBOT_DIFFERS: "the robot holds something else than it was given (bytes 4-5: number of inputs)",
    ErrorCode.ROBOT_UNAVAILABLE: "the controller does not have mapped fields, or gave them to another client "
    "(bytes 4-5: number of variables)",
    ErrorCode.WRITE_WAITED: "an RPDO was dropped: it waited too long during a gap",
    ErrorCode.WRITE_CONTRADICTED: "an RPDO was dropped: it has a variable twice, with two values",
}


def emergencies() -> str:
    """The EMCY codes with the bits of 1001h."""
    rows = [
        (f"{code.value:04X}h", f"{register_of(code):02X}h" if code else "remaining errors", _ERRORS[code])
        for code in ErrorCode
    ]
    return table(("code", "1001h", "meaning"), rows)


def happenings() -> str:
    """What happens to the node, and what follows."""
    text = _docstring_table("communication_errors.py").replace("`OVERRUN_TIME`", f"{OVERRUN_TIME:g} s")
    text = text.replace("`DOUBLED_TIME`", f"{DOUBLED_TIME:g} s")
    return text.replace("`QUIET`", f"{QUIET:g} s")


def received_pdos() -> str:
    """What becomes of an RPDO."""
    return _docstring_table("pdo/receive.py")


def pdo_changes() -> str:
    """What an SDO client may change of PDOs, and when."""
    return _docstring_table("pdo/parameters.py")


def error_behaviour() -> str:
    """1029h."""
    words = {0: "leave OPERATIONAL", 1: "stay as it is", 2: "stop"}
    rows = [
        (
            value,
            word,
            "; ".join(
                f"{state.name} -> {command.name.replace('_', ' ')}"
                for (number, state), command in REACTIONS.items()
                if number == value
            ),
        )
        for value, word in words.items()
    ]
    return table(("1029h:01", "meaning", "transitions"), rows)


def aborts() -> str:
    """The abort codes that stand for a refusal."""
    extra = {Reason.OUT_OF_LIMITS: "0609 0031h too high, 0609 0032h too low, else "}
    rows = []
    for reason in Reason:
        code = f"{ABORT_OF[reason].value:08X}"
        rows.append((reason.value, reason.text, f"{extra.get(reason, '')}{code[:4]} {code[4:]}h"))
    return table(("reason", "in words", "abort code"), rows)


_STATES: Mapping[BusState, tuple[str, str]] = {
    BusState.ABSENT: ("there is no such interface", "opens it by its name as soon as it exists"),
    BusState.DOWN: ("it is not configured, or was taken down", "uses it as soon as it is up"),
    BusState.BUS_OFF: ("the controller has cut itself off", "uses it as soon as the kernel has restarted it"),
    BusState.PASSIVE: (
        "frames are transmitted, but the controller can no longer signal errors",
        "sends EMCY 8120h",
    ),
    BusState.WARNING: ("an error counter has reached 96", "nothing; check the cable"),
    BusState.ACTIVE: ("no fault", ""),
}


def bus_states() -> str:
    """The states of the bus by the number in the status block."""
    rows = [
        (state.value + 1, f"`{state.name.lower().replace('_', '-')}`", *_STATES[state]) for state in BusState
    ]
    return table(("can_bus", "state", "meaning", "what the gateway does"), rows)


def lss_commands() -> str:
    """What an LSS master can ask for."""
    groups: dict[str, list[Command]] = {}
    for command in Command:
        groups.setdefault(_LSS_GROUPS[command.name.split("_")[0]], []).append(command)
    rows = [(what, ", ".join(f"{one.value:02X}h" for one in commands)) for what, commands in groups.items()]
    return table(("service", "command specifiers"), rows)


_LSS_GROUPS = {
    "SWITCH": "switch mode, all nodes",
    "CONFIGURE": "configure node-ID, bit timing",
    "ACTIVATE": "activate bit timing",
    "STORE": "store",
    "SELECT": "switch mode, one node by its identity",
    "SELECTED": "switch mode, one node by its identity",
    "IDENTIFY": "identify remote slaves",
    "IDENTIFIED": "identify remote slaves",
    "NON": "identify remote slaves",
    "FASTSCAN": "fastscan",
    "INQUIRE": "inquire identity and node-ID",
}


# -- bus load ---------------------------------------------------------------------------------------------------------


def frame_lengths() -> str:
    """The greatest length of frames, and the time that they take."""
    rates = (125_000, 250_000, 500_000, 1_000_000)
    rows = [
        (
            length,
            frame_bits(length),
            *(f"{frame_bits(length) / rate * 1e6:.0f} us" for rate in rates),
        )
        for length in (0, 1, 2, 4, 8)
    ]
    return table(("bytes of data", "maximum bits", *(f"{rate // 1000} kbit/s" for rate in rates)), rows)


class _Image(Enum):
    """Ways to put 64 bits, 24 integers and 24 reals of each direction on one bus."""

    PLAIN = ("REAL64, sent on change", "", "REAL64")
    REAL32 = ("REAL32 instead", "", "REAL32")
    INHIBIT = ("and an inhibit time of 20 ms", "pdo: {inhibit: 20ms}", "REAL32")
    SLOWER = ("an inhibit time of 50 ms", "pdo: {inhibit: 50ms}", "REAL32")
    SYNC = ("SYNC every 50 ms", "pdo: {transmission: sync}, sync: {period: 50ms}", "REAL32")

    @property
    def text(self) -> bytes:
        """The mapping file."""
        words, extra, real = self.value
        assert words
        kinds = (("bit", 64, ""), ("int", 24, ""), ("double", 24, real))
        lines = [
            f"  {side}_{kind}: {{robot: {side}put_{kind}_register_0..{count - 1}, "
            f"canopen: {f'{{type: {name}}}' if name else 'auto'}}}"
            for side in ("in", "out")
            for kind, count, name in kinds
        ]
        return (
            "gatewayd: 1\ncell: image\nrobot: {host: robot, series: e, frequency: 125}\n"
            "canopen: {channel: can0, bitrate: 1000000, node: 16, "
            f"cob_ids: {{tpdo: 0x680..0x6A3, rpdo: 0x6A4..0x6C7}}{', ' if extra else ''}{extra}}}\n"
            "writers: {line: {canopen: any}}\nvariables:\n" + "\n".join(lines) + "\n"
        ).encode()


def image_loads() -> str:
    """What the full image takes of a bus, laid out in several ways."""
    rates = [rate for rate in BIT_RATES if rate >= 125_000]
    rows = []
    for image in _Image:
        loaded = load(image.text, "image")
        loads = load_by_bit_rate(loaded.cell)
        pdos = len(pdo_rows(loaded.cell))
        rows.append((image.value[0], pdos, *(f"{loads[rate]:.0%}" for rate in rates)))
    return table(("layout", "PDOs", *(f"{rate // 1000} kbit/s" for rate in rates)), rows)


def pdo_kinds() -> str:
    """Which entries of the dictionary a PDO may carry."""
    found = {pdo for one in _sample() for entry in one.entries for pdo in [entry.pdo]}
    assert found == set(Pdo)
    rows = [
        ("output (from the robot)", "`ro`", "TPDO"),
        ("input (towards the robot), some CANopen writer", "`rww`", "RPDO"),
        ("input without a CANopen writer", "`ro`", "none"),
        ("status block", "`ro`", "TPDO"),
        ("its words request and release", "`rw`", "none"),
    ]
    return table(("what", "access", "may be mapped into"), rows)


PARTS: dict[str, Callable[[], str]] = {
    "communication-objects": communication_objects,
    "status-objects": status_objects,
    "nmt-services": nmt_services,
    "connection-set": connection_set,
    "emergencies": emergencies,
    "node-events": happenings,
    "received-pdos": received_pdos,
    "pdo-changes": pdo_changes,
    "error-behaviour": error_behaviour,
    "abort-codes": aborts,
    "bus-states": bus_states,
    "lss-commands": lss_commands,
    "frame-lengths": frame_lengths,
    "image-loads": image_loads,
    "pdo-kinds": pdo_kinds,
}
"""Name of a part -> what makes it."""
