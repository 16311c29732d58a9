"""What the mapping says of a writer's heartbeat, and the supervision by CiA 301 beside it: two state machines."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.canopen.frame import Frame
from gatewayd.canopen.heartbeat import WATCH, Consumer, HeartbeatConsumer, Seen, Watch
from gatewayd.links.canopen_node.promise import PROMISE, Promise, Promises, Sign

NODE, OTHER, LINE, TOOL = 7, 9, 0, 1
PROMISED = 500
HEARTBEAT, BOOT_UP = b"\5", b"\0"


class Bench:
    """One node whose heartbeat two writers promised, and what is reported of it."""

    def __init__(self, *consumers: Consumer) -> None:
        self.reported: list[str] = []
        self.also = math.inf
        self.promises = Promises(
            consumers or (Consumer(NODE, PROMISED, LINE), Consumer(NODE, PROMISED, TOOL)),
            also=lambda _node: self.also,
            broken=lambda _node, _now: self.reported.append("broken"),
            booted=lambda _node, _now: self.reported.append("booted"),
        )

    def hear(self, now: float, data: bytes = HEARTBEAT) -> bool:
        return self.promises.receive(Frame(0x700 + NODE, data), now)

    @property
    def state(self) -> Promise | None:
        return self.promises.state(NODE)


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_tables_name_states_and_signs_that_exist_and_change_something() -> None:
    assert all(old is not new for (old, _sign), new in PROMISE.items())
    assert {sign for _state, sign in PROMISE} == set(Sign)
    assert {state for state, _sign in PROMISE} == set(Promise)


def test_it_begins_with_the_first_write_and_no_later_write_prolongs_it(bench: Bench) -> None:
    bench.hear(0.0)
    assert (bench.state, bench.promises.next_deadline(0.0)) == (Promise.IDLE, math.inf)
    for now in (1.0, 1.2, 1.4):
        bench.promises.write(TOOL if now > 1.0 else LINE, now)
    assert bench.promises.next_deadline(1.4) == 1.5
    bench.promises.tick(1.49)
    assert bench.reported == []
    bench.promises.tick(1.5)
    bench.promises.tick(9.0)
    assert (bench.reported, bench.state) == (["broken"], Promise.BROKEN)


def test_each_heartbeat_gives_one_more_time(bench: Bench) -> None:
    bench.promises.write(LINE, 0.0)
    for now in (0.4, 0.8):
        assert bench.hear(now)
        bench.promises.tick(now)
    assert bench.state is Promise.KEPT
    assert bench.promises.next_deadline(0.8) == pytest.approx(1.3)


def test_who_boots_begins_anew_unless_it_was_missed(bench: Bench) -> None:
    bench.promises.write(LINE, 0.0)
    assert not bench.hear(0.1, BOOT_UP)
    assert (bench.reported, bench.state) == (["booted"], Promise.IDLE)
    bench.promises.write(LINE, 1.0)
    bench.promises.tick(1.5)
    bench.hear(1.6, BOOT_UP)
    assert bench.promises.state(NODE) is Promise.BROKEN
    bench.hear(1.7)
    assert bench.state is Promise.KEPT


def test_1016h_may_only_be_stricter(bench: Bench) -> None:
    bench.promises.write(LINE, 0.0)
    assert bench.promises.next_deadline(0.0) == 0.5
    bench.also = 0.2
    assert bench.promises.next_deadline(0.0) == 0.2
    bench.also = 60.0
    assert bench.promises.next_deadline(0.0) == 0.5


def test_of_two_times_for_one_node_the_shorter_holds() -> None:
    bench = Bench(Consumer(NODE, 500, LINE), Consumer(NODE, 300, TOOL), Consumer(OTHER, 100, None))
    bench.promises.write(LINE, 0.0)
    assert bench.promises.next_deadline(0.0) == 0.3
    assert bench.promises.nodes == {NODE}
    assert (bench.promises.node(LINE), bench.promises.node(2), bench.promises.node(None)) == (
        NODE,
        None,
        None,
    )


def test_after_a_gap_of_our_own_silence_counts_anew(bench: Bench) -> None:
    bench.promises.gap(4.0, 5.0)
    assert bench.promises.next_deadline(5.0) == math.inf
    bench.promises.write(LINE, 5.0)
    bench.promises.gap(5.1, 9.0)
    bench.promises.tick(9.4)
    assert bench.reported == []
    bench.promises.tick(9.5)
    bench.promises.gap(10.0, 20.0)
    assert bench.state is Promise.BROKEN


def test_another_one_of_the_same_plan_goes_on(bench: Bench) -> None:
    bench.promises.write(LINE, 0.0)
    successor = Bench()
    successor.promises.resume(bench.promises)
    assert successor.promises.next_deadline(0.0) == 0.5
    successor.promises.restart()
    assert successor.state is Promise.IDLE


# -- both supervisions, against what their tables mean ----------------------------------------------------------------


_TIMES = (0, 200, 500, 60_000)
"""What somebody writes into 1016h."""
_MIN = 0.2
_EVENTS = st.one_of(
    st.sampled_from(["write", "heartbeat", "boot", "gap", "read"]), st.sampled_from(_TIMES).map(str)
)


class Both:
    """The two supervisions of one node, and beside them what was seen of it."""

    def __init__(self) -> None:
        self.now = 0.0
        self.lost: list[float] = []
        self.broken: list[float] = []
        self.consumer = HeartbeatConsumer(
            (Consumer(NODE, PROMISED, LINE),),
            lost=lambda _node, now: self.lost.append(now),
            back=lambda _node, _now: None,
            changed=lambda: None,
        )
        self.promises = Promises(
            (Consumer(NODE, PROMISED, LINE),),
            also=self.consumer.time,
            broken=lambda _node, now: self.broken.append(now),
            booted=lambda _node, _now: None,
        )
        self.sign = -math.inf
        """The last heartbeat, the write that began the promise, or the end of a gap."""
        self.heard = False
        """A heartbeat came since 1016h watches the node as it does."""
        self.bound = False
        self.spared = False
        """A gap has given a whole time since."""

    @property
    def is_broken(self) -> bool:
        return self.promises.state(NODE) is Promise.BROKEN

    def wait(self, seconds: float) -> None:
        end = self.now + seconds
        while (due := min(one.next_deadline(self.now) for one in (self.consumer, self.promises))) <= end:
            self.now = max(self.now, due)
            self.consumer.tick(self.now)
            self.promises.tick(self.now)
        self.now = end

    def check(self) -> None:
        silent = self.now - self.sign
        assert not self.bound or self.is_broken or silent < PROMISED / 1000 + 1e-9, "silent and believed"
        assert not self.lost or self.heard, "8130h before the first heartbeat"
        assert not self.broken or self.bound, "missed before the first write"
        assert all(now - self.sign >= _MIN - 1e-9 for now in self.broken), "heard and missed"
        self.lost.clear()
        self.broken.clear()

    def write(self) -> None:
        if self.promises.state(NODE) is Promise.IDLE:
            self.sign, self.bound, self.spared = self.now, True, False
        self.promises.write(LINE, self.now)

    def hear(self, data: bytes) -> None:
        frame = Frame(0x700 + NODE, data)
        self.consumer.receive(frame, self.now)
        self.promises.receive(frame, self.now)

    def heartbeat(self) -> None:
        self.hear(HEARTBEAT)
        self.sign, self.heard, self.spared = self.now, True, False

    def boot(self) -> None:
        self.bound = self.is_broken
        self.hear(BOOT_UP)
        self.heard = self.heard and self.consumer.state(NODE) is Watch.LOST

    def gap(self) -> None:
        """The process stands still for a quarter of a second; nobody is silent in it."""
        since, self.now = self.now, self.now + 0.25
        self.sign = min(self.sign + 0.25, self.now) if self.spared else self.now
        self.spared = self.bound
        self.consumer.gap(since, self.now)
        self.promises.gap(since, self.now)

    def read(self) -> None:
        """Nothing is written and nobody is heard."""

    def watch(self, milliseconds: int) -> None:
        """Somebody writes 1016h."""
        before = self.consumer.time(NODE)
        value = NODE << 16 | milliseconds if milliseconds else 0
        self.consumer._entries[0].write(value.to_bytes(4, "little"))
        self.consumer.tick(self.now)
        self.heard = self.heard and before == self.consumer.time(NODE)


@given(st.lists(st.tuples(st.integers(1, 400), _EVENTS), max_size=60))
def test_nobody_silent_is_believed_and_nobody_heard_is_missed(steps: list[tuple[int, str]]) -> None:
    """Random writes, reads, heartbeats, boots, gaps of our own and values of 1016h."""
    both = Both()
    for milliseconds, event in steps:
        both.wait(milliseconds / 1000)
        both.check()
        if event.isdigit():
            both.watch(int(event))
        else:
            getattr(both, event)()


@given(st.lists(st.tuples(st.sampled_from(Seen), st.integers(1, 100))))
def test_the_watch_is_lost_only_after_it_was_alive(steps: list[tuple[Seen, int]]) -> None:
    state, alive = Watch.WAITING, False
    for seen, _pause in steps:
        state = WATCH.get((state, seen), state)
        alive = alive or state is Watch.ALIVE
        assert state is not Watch.LOST or alive
