"""Rockwell's Modbus client for Logix controllers, told what to do, and its data copied into and from the image.

The add-on instruction `raC_Opr_NetModbusTCPClient` comes as a rung that is imported, with its MESSAGE tags: only the
tool can make those, so the call is in that rung, and here is all that its tags have to hold. Its interface and bounds
are those of Rockwell's own export (revision 2, exported by version 31): a request is repeated after `PollInterval`,
`TransComplete` and `TransStat` say how the last one ended, and it takes no more than is said below.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from gatewayd.links.modbus_server.plc.model import PlcModel, Poll
from gatewayd.links.modbus_server.plc.st.exchange import cyclic
from gatewayd.modbus.areas import Area
from gatewayd.modbus.codec import TYPES
from gatewayd.plc.logix.l5x import LogixMember
from gatewayd.report.format import counted

MAX_REGISTERS: Final = 120
MAX_BITS: Final = 256
"""In one transaction."""
MAX_TRANSACTIONS: Final = 32
"""It has so many flags for requests that are due."""
DATA_SIZE: Final = 1024
"""Elements of each array of its data."""
_DATA: Final = {
    Area.COIL: "Coils_0xxx",
    Area.DISCRETE: "DiscInputs_1xxx",
    Area.INPUT: "InpRegisters_3xxx",
    Area.HOLDING: "HoldRegisters_4xxx",
}
_SLOW: Final = 1000
"""Milliseconds from one reading of a slow table to the next."""


@dataclass(frozen=True, slots=True)
class Transaction:
    """One request of the client."""

    poll: Poll
    first: int
    """Element of the array of the image with which it begins."""
    count: int
    local: int
    """Element of the array of the client's data."""


class TooMuch(Exception):
    """The client cannot hold it; the text says what."""


def transactions(model: PlcModel) -> tuple[Transaction, ...]:
    """The poll plan in what the client takes at once; no value lies in two requests. Raises TooMuch."""
    found: list[Transaction] = []
    used = dict.fromkeys(Area, 0)
    for poll in cyclic(model):
        for first, count in _parts(poll):
            found.append(Transaction(poll, first, count, used[poll.area]))
            used[poll.area] += count
    for area, size in used.items():
        if size > DATA_SIZE:
            raise TooMuch(f"{counted(size, 'element')} of {_DATA[area]}, and it has {DATA_SIZE}")
    if len(found) > MAX_TRANSACTIONS:
        raise TooMuch(f"{counted(len(found), 'transaction')}, and it takes {MAX_TRANSACTIONS}")
    return tuple(found)


def _parts(poll: Poll) -> Iterator[tuple[int, int]]:
    """First element and count of each request."""
    most = MAX_BITS if poll.area.of_bits else MAX_REGISTERS
    inside = {
        tag.address - poll.address + word
        for tag in poll.tags
        if tag.encoding is not None
        for word in range(1, TYPES[tag.encoding.type].words)
    }
    first = 0
    while first < poll.count:
        end = min(first + most, poll.count)
        while end in inside:
            end -= 1
        yield first, end - first
        first = end


def client(model: PlcModel, plan: Sequence[Transaction]) -> Iterator[str]:
    """The routine; it is called before the others, so that they have what was read last."""
    prefix = model.prefix
    name = f"{prefix}_Client"
    yield f"// The rung of Rockwell's client is imported under the name {name}: see the tutorial. It needs"
    yield f"// {name}_Transactions[{len(plan)}]. Rung and routine belong to the same task."
    yield f"{name}_EN := 1;"
    yield f"{name}_Parameters.DestinationPort := {model.port};"
    yield f"{name}_Parameters.DestAddress.LEN := {len(model.host)}; // {model.host}"
    for index, character in enumerate(model.host):
        yield f"{name}_Parameters.DestAddress.DATA[{index}] := {ord(character)};"
    yield f"{prefix}_All_Written := 1;"
    for number, each in enumerate(plan):
        yield from _transaction(model, number, each)
    writes = [number for number, each in enumerate(plan) if each.poll.writes]
    if writes:
        yield f"IF {prefix}_Status.trusted AND {prefix}_Write AND {prefix}_All_Written THEN"
        yield f"  {prefix}_Written := {prefix}_Written + 1;"
        yield from (f"  {prefix}_Confirmed[{number}] := 0;" for number in writes)
        yield "END_IF;"


def _transaction(model: PlcModel, number: int, each: Transaction) -> Iterator[str]:
    poll, prefix = each.poll, model.prefix
    place = f"{prefix}_Client_Transactions[{number}]"
    unit = model.unit - 256 if model.unit > 127 else model.unit
    interval = _SLOW if poll.slow else round(model.period * 1000)
    yield f"// {poll.name}: {poll.what}"
    yield f"{place}.TransType := {poll.function};"
    yield f"{place}.StationID := {unit};"
    yield f"{place}.BeginAddress := {poll.address + each.first};"
    yield f"{place}.Count := {each.count};"
    yield f"{place}.LocalAddress := {each.local};"
    yield f"{place}.PollInterval := {interval};"
    if not poll.writes:
        yield f"{place}.Enabled := 1;"
        yield from _copied(model, each)
        return
    wanted = f"{prefix}_Status.trusted AND {prefix}_Write"
    if poll.shared:
        wanted += f" AND {prefix}_Demand_{poll.name}"
    yield from _copied(model, each)
    yield f"{place}.Enabled := {wanted};"
    # The client needs TransComplete itself: it is watched, never cleared here.
    yield f"IF {place}.TransComplete AND NOT {prefix}_Was[{number}] AND ({place}.TransStat = 0) THEN"
    yield f"  {prefix}_Confirmed[{number}] := 1;"
    yield "END_IF;"
    yield f"{prefix}_Was[{number}] := {place}.TransComplete;"
    yield f"IF {place}.Enabled AND NOT {prefix}_Confirmed[{number}] THEN"
    yield f"  {prefix}_All_Written := 0;"
    yield "END_IF;"


def _copied(model: PlcModel, each: Transaction) -> Iterator[str]:
    """Registers at once; truths one by one, because COP takes them in groups of 32 only."""
    data = f"{model.prefix}_Client_Data.{_DATA[each.poll.area]}"
    image = f"{model.prefix}_Image.{each.poll.name}"
    if each.poll.area.of_bits:
        index = f"{model.prefix}_N"
        sides = f"{image}[{index} + {each.first}]", f"{data}[{index} + {each.local}]"
        target, source = reversed(sides) if each.poll.writes else sides
        yield f"FOR {index} := 0 TO {each.count - 1} DO"
        yield f"  {target} := {source};"
        yield "END_FOR;"
        return
    sides = f"{data}[{each.local}]", f"{image}[{each.first}]"
    source, target = reversed(sides) if each.poll.writes else sides
    yield f"COP({source}, {target}, {each.count});"


def client_tags(model: PlcModel, plan: Sequence[Transaction]) -> Iterator[LogixMember]:
    """What the routine remembers, and the switches of what others may hold."""
    prefix = model.prefix
    if plan:
        yield LogixMember(f"{prefix}_All_Written", "BOOL")
    if model.writes:
        yield LogixMember(f"{prefix}_Written", "DINT", 0, "rounds in which all writes were confirmed")
    if plan and model.writes:
        yield LogixMember(f"{prefix}_Confirmed", "BOOL", len(plan))
        yield LogixMember(f"{prefix}_Was", "BOOL", len(plan))
    for poll in model.writes:
        if poll.shared:
            text = "1: write it in every round, which takes its lock"
            yield LogixMember(f"{prefix}_Demand_{poll.name}", "BOOL", 0, text)
