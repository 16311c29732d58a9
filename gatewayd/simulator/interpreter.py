"""Runs the rules of a robot program on the variables of the controller.

Names are looked up and every rule becomes one function when the program is loaded. Neighbouring plain echoes of equal
type are joined into one copy: the whole reserved range costs four of them.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Container, Iterable

from gatewayd.rtde.types import DataType
from gatewayd.simulator.program import FieldReference, ProgramRule, RuleOperation
from gatewayd.simulator.signals import CYCLE_FIELDS
from gatewayd.simulator.store import FieldStore, Scalar, fitting

_Read = Callable[[], Scalar]
_Write = Callable[[Scalar], None]
_Copy = tuple[slice, slice]


class Interpreter:
    """A loaded program.

    `protected` fields cannot be targets; one that moves by itself moves no more once it is a target. Raises
    ProgramError for a rule that names what is not there.
    """

    def __init__(
        self, rules: Iterable[ProgramRule], store: FieldStore, base_rate: float, protected: Container[str]
    ) -> None:
        self._store = store
        self._cells = store.cells
        self._rate = base_rate
        self._protected = protected
        self._steps: list[Callable[[], None]] = []
        self._now = 0
        moving: list[str] = []
        pending: list[_Copy] = []
        for rule in rules:
            if rule.input is not None and store.moves(rule.input.field):
                moving.append(rule.input.field)
            copy = self._copy(rule)
            if copy is not None:
                _join(pending, copy)
                continue
            self._flush(pending)
            self._steps.append(self._assignment(rule))
        self._flush(pending)
        self._moving = tuple(dict.fromkeys(moving))

    def run(self, cycles: int = 1) -> None:
        """Run every rule once; `cycles` control cycles have passed since the last time."""
        if not self._steps:
            return
        if self._moving:
            self._store.refresh(self._moving)
        self._now += cycles
        for step in self._steps:
            step()
        self._store.edition += 1

    def _copy(self, rule: ProgramRule) -> _Copy | None:
        """Where a rule copies between equal cells, if that is all it does."""
        target, source = self._target(rule.target), rule.input
        if source is None or not rule.plain or rule.target.of_bit or source.of_bit:
            return None
        if self._type(source).code != self._store.type(rule.target.field).code:
            return None
        at = self._cell(source)
        return slice(target, target + 1), slice(at, at + 1)

    def _flush(self, pending: list[_Copy]) -> None:
        for target, source in pending:
            self._steps.append(self._copier(target, source))
        pending.clear()

    def _copier(self, target: slice, source: slice) -> Callable[[], None]:
        cells = self._cells

        def step() -> None:
            cells[target] = cells[source]

        return step

    def _assignment(self, rule: ProgramRule) -> Callable[[], None]:
        value, write = self._value(rule), self._writer(rule.target)
        return lambda: write(value())

    def _value(self, rule: ProgramRule) -> _Read:
        if rule.operation is RuleOperation.CONSTANT:
            return lambda: rule.offset
        if rule.operation in (RuleOperation.COUNT, RuleOperation.TOGGLE):
            return self._edges(rule)
        assert rule.input is not None
        read = self._reader(rule.input)
        if rule.operation is RuleOperation.NOT:
            read = _inverted(read)
        elif rule.scale != 1 or rule.offset:
            read = _scaled(read, rule.scale, rule.offset)
        if rule.after:
            read = self._delayed(read, self._cycles(rule.after))
        return self._pulse(read, self._cycles(rule.pulse)) if rule.pulse else read

    def _edges(self, rule: ProgramRule) -> _Read:
        """Counts or toggles from the target's own value, so that writing it from outside sets the counter."""
        own = self._reader(rule.target)
        happened = self._rising(self._reader(rule.input)) if rule.input else self._interval(rule.every)
        if rule.operation is RuleOperation.TOGGLE:
            return lambda: not own() if happened() else own()
        largest = 0x7FFF_FFFF
        return lambda: ((own() + 1) if own() < largest else 0) if happened() else own()

    def _interval(self, seconds: float) -> Callable[[], bool]:
        cycles = due = self._cycles(seconds)

        def happened() -> bool:
            nonlocal due
            if self._now < due:
                return False
            due = self._now - self._now % cycles + cycles
            return True

        return happened

    def _rising(self, read: _Read) -> Callable[[], bool]:
        before: Scalar = read()

        def happened() -> bool:
            nonlocal before
            last, before = before, read()
            return bool(before and not last)

        return happened

    def _delayed(self, read: _Read, cycles: int) -> _Read:
        shown = last = read()
        coming: deque[tuple[int, Scalar]] = deque()

        def delayed() -> Scalar:
            nonlocal shown, last
            value = read()
            if value != last:
                last = value
                coming.append((self._now + cycles, value))
            while coming and coming[0][0] <= self._now:
                shown = coming.popleft()[1]
            return shown

        return delayed

    def _pulse(self, read: _Read, cycles: int) -> _Read:
        rising, until = self._rising(read), 0

        def pulse() -> Scalar:
            nonlocal until
            if rising():
                until = self._now + cycles
            return self._now < until

        return pulse

    def _cycles(self, seconds: float) -> int:
        return max(1, round(seconds * self._rate))

    def _reader(self, reference: FieldReference) -> _Read:
        cells, at, bit = self._cells, self._cell(reference), reference.part
        if reference.of_bit:
            return lambda: int(cells[at]) >> (bit or 0) & 1
        return lambda: cells[at]

    def _writer(self, reference: FieldReference) -> _Write:
        cells, at, code = self._cells, self._target(reference), self._type(reference).code
        if not reference.of_bit:

            def write(value: Scalar) -> None:
                cells[at] = fitting(value, code)

            return write
        mask = 1 << (reference.part or 0)

        def write_bit(value: Scalar) -> None:
            cells[at] = int(cells[at]) | mask if value else int(cells[at]) & ~mask

        return write_bit

    def _target(self, reference: FieldReference) -> int:
        at = self._cell(reference)
        if reference.field in self._protected:
            raise reference.error(f"{reference.field} is a controller input: only clients write it")
        if reference.field in CYCLE_FIELDS:
            raise reference.error(f"{reference.field} follows the controller's cycles and cannot be a target")
        if self._store.moves(reference.field):
            self._store.pin(reference.field, self._store.read(reference.field))
        return at

    def _type(self, reference: FieldReference) -> DataType:
        if reference.field not in self._store:
            raise reference.error(f"the controller has no field {reference.field!r}")
        return self._store.type(reference.field)

    def _cell(self, reference: FieldReference) -> int:
        kind, part = self._type(reference), reference.part
        start = self._store.place(reference.field).start
        if part is None or reference.of_bit:
            if kind.is_vector:
                raise reference.error(
                    f"{reference.field} has {kind.count} elements: write {reference.field}[0]"
                )
            if reference.of_bit and (kind.code not in _BITS or (part or 0) >= _BITS[kind.code]):
                raise reference.error(f"{reference.field} ({kind.word}) has no bit {part}")
            return int(start)
        if part >= kind.count:
            raise reference.error(f"{reference.field} ({kind.word}) has no element {part}")
        return int(start) + part


_BITS = {"B": 8, "I": 32, "Q": 64}


def _join(pending: list[_Copy], copy: _Copy) -> None:
    """Add `copy`, as part of the last one where it goes on from there."""
    target, source = copy
    if pending:
        last_target, last_source = pending[-1]
        to, of = slice(last_target.start, target.stop), slice(last_source.start, source.stop)
        follows = last_target.stop == target.start and last_source.stop == source.start
        # A copy that would read what it writes itself must stay a sequence of single ones.
        if follows and (of.stop <= to.start or to.stop <= of.start):
            pending[-1] = (to, of)
            return
    pending.append(copy)


def _inverted(read: _Read) -> _Read:
    return lambda: not read()


def _scaled(read: _Read, scale: float, offset: float) -> _Read:
    return lambda: read() * scale + offset
