"""Whatever happens to a cell, a command acts only on an explicit 0 and then an explicit 1 by its unchanged owner.

The second account keeps the whole story of one command as a list of words, and looks back through it.
"""

from __future__ import annotations

from dataclasses import replace

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, rule

from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.commands import MAX_WAITED, Attempt
from gatewayd.core.definition import OPERATOR
from gatewayd.core.events import Event, EventKind
from gatewayd.core.ownership import Act
from gatewayd.core.requester import Requester
from gatewayd.core.succession import succeed
from tests.core.test_commands import LOAD, PLAY, VIA, definition, robot_up

_HANDS = {EventKind.ACQUIRED, EventKind.TAKEN_OVER, EventKind.RELEASED}
_BOTH = (PLAY, LOAD)

_DISTURBANCES = ("nothing", "lock", "connection_ends", "time_passes", "operator", "session", "link", "reload")

writers = st.sampled_from([0, 0, 1])
connections = st.sampled_from([1, 1, 1, 2])
written = st.dictionaries(
    st.sampled_from(_BOTH), st.tuples(st.integers(0, 2), st.sampled_from([False, False, True])), min_size=1
)
commands = st.sampled_from(_BOTH)


class AnyStory(RuleBasedStateMachine):
    """Writes of two writers by two connections each, and all else that changes owners, values and sessions."""

    def __init__(self) -> None:
        super().__init__()
        self.now = 0.0
        self.story: dict[int, list[object]] = {PLAY: [], LOAD: []}
        self.acted: list[Attempt] = []
        self._serve(Cell(definition(lease=1.0)))
        self.cell.carried.begin(VIA, 0.0)
        robot_up(self.cell)

    def _serve(self, cell: Cell) -> None:
        self.cell = cell
        cell.commands.listeners.append(
            lambda attempt: self.acted.append(attempt) if attempt.obstacle is None else None
        )
        cell.events.listeners.append(self._hear)

    def _hear(self, event: Event) -> None:
        if event.kind in _HANDS and event.lock in self.story:
            self.story[event.lock].append("changed hands")

    def _break(self) -> None:
        for story in self.story.values():
            story.append("broken")

    def _expected(self, command: int, change: Change, requester: Requester) -> bool:
        """Looking back: is the newest word an explicit 0 by the same hand? An implied 0 leaves things as they are."""
        if change.implied or not change.value or requester.waited > MAX_WAITED:
            return False
        told = [word for word in self.story[command] if word != ("implied", 0)]
        return told[-1:] == [(requester.writer, requester.connection, 0)]

    @rule(
        writer=writers,
        connection=connections,
        values=written,
        waited=st.sampled_from([0.0, 0.0, 0.0, 0.6]),
    )
    def write(self, writer: int, connection: int, values: dict[int, tuple[int, bool]], waited: float) -> None:
        """A request with one or both commands, explicit or implied."""
        requester = Requester(writer, connection=connection, waited=waited)
        changes = [
            Change(command, bool(value) if command == PLAY else value, implied)
            for command, (value, implied) in values.items()
        ]
        refused = self.cell.write(requester, changes, self.now) is not None
        expected = set()
        for change in changes:
            command = change.variable
            unwritten = self.cell.ownership.owners[command] != writer
            if refused or unwritten:
                continue
            if self._expected(command, change, requester):
                expected.add((command, change.value))
            word: object = ("implied", change.value) if change.implied else (writer, connection, change.value)
            self.story[command].append(word)
        assert {(attempt.variable, attempt.value) for attempt in self.acted} == expected
        self.acted.clear()

    @rule(
        hand=st.tuples(writers, connections),
        other=st.none() | st.tuples(writers, connections),
        command=commands,
        between=st.sampled_from(("nothing", *_DISTURBANCES)),
        how=st.sampled_from(["plainly", "plainly", "implied", "late"]),
    )
    def zero_and_one(
        self, hand: tuple[int, int], other: tuple[int, int] | None, command: int, between: str, how: str
    ) -> None:
        """What random writes hardly ever come to: 0, something, and 1, mostly by the same hand."""
        self.write(*hand, {command: (0, False)}, 0.0)
        if between == "lock":
            self.lock(hand[0], command, Act.RELEASE)
            self.lock(hand[0], command, Act.REQUEST)
        elif between == "connection_ends":
            self.connection_ends(*hand)
        elif between == "time_passes":
            self.time_passes(1.5)
        elif between == "operator":
            self.operator(command, holding=True)
            self.operator(command, holding=False)
        elif between != "nothing":
            getattr(self, between)()
        self.write(*(other or hand), {command: (1, how == "implied")}, 0.6 if how == "late" else 0.0)

    @rule(writer=writers, command=commands, act=st.sampled_from([Act.REQUEST, Act.RELEASE]))
    def lock(self, writer: int, command: int, act: Act) -> None:
        """A lock is asked for, or given back."""
        ask = self.cell.request if act is Act.REQUEST else self.cell.release
        ask(Requester(writer, connection=1), command, self.now)

    @rule(writer=writers, connection=connections)
    def connection_ends(self, writer: int, connection: int) -> None:
        """A connection of a writer comes and goes; the other one stays."""
        requester = Requester(writer, connection=connection)
        self.cell.writer_connected(replace(requester, connection=9), self.now)
        self.cell.writer_connected(requester, self.now)
        self.cell.writer_disconnected(requester, self.now, "closed")

    @rule(seconds=st.sampled_from([0.1, 0.6, 1.5]))
    def time_passes(self, seconds: float) -> None:
        """Leases and graces end."""
        self.now += seconds
        self.cell.tick(self.now)

    @rule(command=commands, holding=st.booleans())
    def operator(self, command: int, holding: bool) -> None:
        """The local operator takes a lock, or gives back what he holds; what he forces is refused."""
        assert self.cell.operator.force(command, 1, self.now, self.now + 1.0) is not None
        if holding:
            self.cell.operator.take_lock(command, self.now)
        elif self.cell.ownership.owners[command] == OPERATOR:
            self.cell.operator.free_lock(command, self.now)

    @rule()
    def session(self) -> None:
        """Another session with the robot."""
        self.cell.robot_lost("closed", self.now)
        robot_up(self.cell, self.now)
        self._break()

    @rule()
    def link(self) -> None:
        """Another connection of the link."""
        self.cell.carried.end(VIA, "closed", self.now)
        self.cell.carried.begin(VIA, self.now)
        self._break()

    @rule()
    def reload(self) -> None:
        """The same mapping again."""
        self._serve(succeed(self.cell, definition(lease=1.0), self.now).cell)
        self._break()

    @rule(command=commands)
    def adopt_again(self, command: int) -> None:
        """Registers come late; the command reads 0, which nobody has written."""
        self.cell.adopt({command: 0}, self.now)

    def teardown(self) -> None:
        """Nothing acted outside of a write."""
        assert not self.acted


TestAnyStory = AnyStory.TestCase
TestAnyStory.settings = settings(max_examples=50, stateful_step_count=30, deadline=None)
