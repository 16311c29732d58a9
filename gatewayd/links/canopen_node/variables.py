"""The variables of a cell as objects of the manufacturer area, for SDO; PDOs map the same objects.

Reading gives the value of the image at that moment. Writing is a write request of the writer that SDO clients are: the
cell applies or refuses it, and counts and records the refusal, whatever was wrong with the value.
"""

from __future__ import annotations

import math
import struct
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from itertools import groupby
from typing import Final

from gatewayd.canopen.datatypes import CanType
from gatewayd.canopen.dictionary import Abort, AbortCode, Access, Entry, Object, Pdo, array
from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.definition import Direction, Value, ValueKind, Variable
from gatewayd.core.refusal import Reason, Refusal
from gatewayd.core.requester import Requester
from gatewayd.encoding.limits import LimitReader, Meaning
from gatewayd.links.canopen_node.plan import CanopenPlan, ObjectPlan
from gatewayd.links.canopen_values import fit, limits_of, meaning

ABORT_OF: Final = {
    Reason.NO_SUCH_ADDRESS: AbortCode.NO_OBJECT,
    Reason.NOT_WRITABLE: AbortCode.READ_ONLY,
    Reason.HELD: AbortCode.LOCAL_CONTROL,
    Reason.OUT_OF_LIMITS: AbortCode.INVALID_VALUE,
    Reason.PARTIAL_VALUE: AbortCode.LENGTH,
    Reason.ROBOT_LOST: AbortCode.DEVICE_STATE,
    Reason.CLAIMED_ELSEWHERE: AbortCode.DEVICE_STATE,
    Reason.HEARTBEAT_LOST: AbortCode.DEVICE_STATE,
    Reason.PARTIAL_TAKEOVER: AbortCode.LENGTH,
    Reason.WAITED: AbortCode.DEVICE_STATE,
    Reason.NOT_MEANT: AbortCode.LOCAL_CONTROL,
    Reason.CONTRADICTED: AbortCode.INVALID_VALUE,
    Reason.NOT_IN_ROLE: AbortCode.READ_ONLY,
}
"""The abort code for an SDO client whose request the cell refuses."""


class VariableObjects:
    """The objects of one cell's variables."""

    def __init__(
        self, plan: CanopenPlan, cell: Cell, clock: Callable[[], float], requester: Callable[[], Requester]
    ) -> None:
        """`clock`: the moment of the request that is being served; `requester`: who SDO clients are when they write."""
        self._plan = plan
        self._cell = cell
        self._clock = clock
        self._requester = requester
        self._received = {
            entry.variable
            for pdo in plan.pdos
            if pdo.direction is Direction.INPUT
            for entry in pdo.entries
            if entry.variable is not None
        }

    def objects(self) -> Iterator[Object]:
        """Arrays by index, each of one type and direction, with the mapping's names as names of the entries."""
        placed = sorted(self._plan.objects, key=lambda item: (item.index, item.subindex))
        used: Counter[str] = Counter()
        for index, group in groupby(placed, key=lambda item: item.index):
            items = tuple(group)
            direction = self._cell.definition.variables[items[0].variable].direction
            name = f"{direction.value.capitalize()} {items[0].type.name}"
            used[name] += 1
            yield array(index, name if used[name] == 1 else f"{name} {used[name]}", map(self._entry, items))

    def _entry(self, item: ObjectPlan) -> Entry:
        declared = self._cell.definition.variables[item.variable]
        name, source = declared.name, partial(self._read, item)
        default = item.type.pack(fit(declared.kind.zero, item.type, item.linear))
        if declared.direction is Direction.OUTPUT:
            return Entry(item.subindex, name, item.type, Access.RO, default, pdo=Pdo.TRANSMIT, source=source)
        low, high = _declared_bounds(declared, item)
        writable = self._is_writable(item.variable)
        return _Input(
            item.subindex,
            name,
            item.type,
            Access.RWW if writable else Access.RO,
            default,
            low=low,
            high=high,
            pdo=Pdo.RECEIVE if writable else Pdo.NONE,
            source=source,
            sink=partial(self._write, item, limits_of(declared, item.type, item.linear)),
        )

    def _is_writable(self, index: int) -> bool:
        plan = self._plan
        return plan.sdo_writer is not None or plan.rpdo_writer is not None or index in self._received

    def _read(self, item: ObjectPlan) -> bytes:
        if item.variable in self._cell.unreadable:
            raise Abort(AbortCode.DEVICE_STATE)
        value = self._cell.image.values[item.variable]
        if item.linear is None:
            with suppress(struct.error, OverflowError):
                return item.type.pack(value)
        return item.type.pack(fit(value, item.type, item.linear))

    def _write(self, item: ObjectPlan, limits: LimitReader | None, data: bytes) -> None:
        declared = self._cell.definition.variables[item.variable]
        requester, now = self._requester(), self._clock()
        read = limits.read if limits is not None else meaning(declared.kind, item.linear)
        refusal, value = self._meaning(item, data, read)
        if refusal is not None:
            self._cell.refuse(requester, refusal, now, value)
        elif value is not None:
            refusal = self._cell.write(requester, [Change(item.variable, value)], now)
        if refusal is not None:
            raise Abort(_abort_code(refusal, declared, value), recorded=True)

    def _meaning(self, item: ObjectPlan, data: bytes, read: Meaning) -> tuple[Refusal | None, Value | None]:
        """What the cell is asked for, or why it need not be."""
        if self._plan.sdo_writer is None:
            return Refusal(Reason.NOT_WRITABLE, item.variable), None
        if len(data) != item.type.size:
            return Refusal(Reason.PARTIAL_VALUE, item.variable), None
        if item.type is CanType.BOOLEAN and data[0] > 1:
            return Refusal(Reason.OUT_OF_LIMITS, item.variable), data[0]
        value = read(item.type.unpack(data))
        return (Refusal(Reason.OUT_OF_LIMITS, item.variable) if value is None else None), value


class _Input(Entry):
    """Leaves length and range to the cell, which records refusals; `low` and `high` are for the EDS."""

    __slots__ = ()

    def write(self, data: bytes) -> None:
        """Hand any bytes to the sink. Raises Abort."""
        assert self.sink is not None
        self.sink(data)


def _abort_code(refusal: Refusal, declared: Variable, value: Value | None) -> AbortCode:
    if refusal.reason is Reason.OUT_OF_LIMITS and value is not None:
        low, high = _accepted(declared)
        if value > high:
            return AbortCode.VALUE_TOO_HIGH
        if value < low:
            return AbortCode.VALUE_TOO_LOW
    return ABORT_OF[refusal.reason]


def _accepted(declared: Variable) -> tuple[float, float]:
    """Between which values the cell may take a value as it is, or clamp it."""
    if declared.kind is ValueKind.BOOL:
        return 0, 1
    low = -math.inf if declared.low is None else declared.low
    high = math.inf if declared.high is None else declared.high
    limits = declared.limits
    if limits is None or limits.clamp:
        return low, high
    return max(low, limits.low), min(high, limits.high)


def _declared_bounds(declared: Variable, item: ObjectPlan) -> tuple[float | None, float | None]:
    """The limits for the EDS, as raw numbers: those that do not follow from the type."""
    low, high = _accepted(declared)
    can_type = item.type
    if item.linear is not None:
        scale, offset = item.linear
        low, high = sorted(_even((end - offset) / scale) for end in (low, high))
    least, greatest = (-math.inf, math.inf) if can_type.is_real else can_type.bounds
    if not can_type.is_real:
        low = low if math.isinf(low) else math.ceil(low)
        high = high if math.isinf(high) else math.floor(high)
    return (low if low > least else None), (high if high < greatest else None)


def _even(raw: float) -> float:
    """Without what dividing by a decimal scale leaves: 2.9999999999999996 is 3."""
    if math.isinf(raw):
        return raw
    near = round(raw)
    return near if abs(raw - near) < 1e-9 * max(1.0, abs(raw)) else raw
