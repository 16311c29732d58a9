"""What inputs hold, read in pieces: plans alone, then whole conversations with a model of a controller."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gatewayd.rtde import messages as m
from gatewayd.rtde.catalogue import OLD_LIST_LIMIT
from gatewayd.rtde.claims import REGISTERS_KEY
from gatewayd.rtde.fields import INPUTS
from gatewayd.rtde.negotiation import Negotiation
from gatewayd.rtde.reading import Reading, fitting
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.session import Session, Wishes
from gatewayd.rtde.steps import Notice, State
from gatewayd.rtde.types import DataType
from tests.rtde.pure_controller import Conversation, PureController

INTS = tuple(f"input_int_register_{n}" for n in range(48))
DOUBLES = tuple(f"input_double_register_{n}" for n in range(48))
BITS = ("input_bit_registers0_to_31", *(f"input_bit_register_{n}" for n in range(64, 128)))
OUTPUTS = tuple(f"output_{kind}_register_{n}" for kind in ("int", "double") for n in range(48))
EVERY_INPUT = tuple(sorted(INPUTS))


def numbered(names: tuple[str, ...]) -> dict[str, int | float | bool]:
    return {name: n % 2 == 0 if INPUTS[name].type is DataType.BOOL else n for n, name in enumerate(names, 1)}


def converse(wishes: Wishes, controller: PureController) -> Conversation:
    conversation = Conversation(Negotiation(wishes), controller)
    conversation.settle()
    return conversation


def test_a_list_takes_what_fits_first_come_first_served() -> None:
    assert fitting(("aaa", "bbbbb", "cc", "d"), 8) == ("aaa", "cc", "d")
    assert fitting(("aaaa", "bbb"), 8) == ("aaaa", "bbb")
    assert fitting(("x" * 9,), 8) == ()


def test_outputs_come_first_and_read_backs_fill_the_list() -> None:
    reading = Reading(Wishes(OUTPUTS[:70], INTS, limited=True))
    working = reading.working()
    assert working[: 1 + 70] == ("timestamp", *OUTPUTS[:70])
    assert len(",".join(working)) <= OLD_LIST_LIMIT
    read_backs = working[71:]
    assert read_backs == INTS[: len(read_backs)]
    assert reading.left_out == dict.fromkeys(INTS[len(read_backs) :], True)


def test_outputs_beyond_the_list_are_left_out_by_name() -> None:
    reading = Reading(Wishes(OUTPUTS, INTS, limited=True))
    left_out = reading.left_out
    assert set(OUTPUTS) - set(reading.working()) <= set(left_out)
    assert not any(left_out[name] for name in left_out if name.startswith("output_"))


def test_a_package_of_another_size_is_no_reading() -> None:
    reading = Reading(Wishes(inputs=INTS[:2], read_back=False))
    assert reading.piece({INTS[0]: DataType.INT32}) == INTS[:1]
    reading.expect(Recipe(INTS[:1], [DataType.INT32]))
    assert not reading.take(bytes(5))
    assert reading.take(bytes(3) + b"\x07")
    assert reading.held == {INTS[0]: (7,)}
    assert reading.piece({INTS[0]: DataType.INT32}) == ()


def test_what_reads_as_another_type_is_unread() -> None:
    reading = Reading(Wishes(inputs=INTS[:1]))
    reading.agree(Recipe(("timestamp", INTS[0]), [DataType.DOUBLE, DataType.UINT32]))
    assert reading.unread({INTS[0]: DataType.INT32}) == {INTS[0]}


@pytest.mark.parametrize("limited", [False, True], ids=["answered with id 0", "known before"])
def test_a_refused_list_costs_no_reading(limited: bool) -> None:
    """Claims, then the readings in pieces, then the working recipe: every register is known before it can be sent."""
    inputs = (*INTS, *DOUBLES, *BITS)
    controller = PureController(limit=OLD_LIST_LIMIT, held=dict(numbered(inputs)))
    conversation = converse(Wishes(OUTPUTS[:48], inputs, limited=limited), controller)
    (session,) = conversation.sessions
    assert session.unread == frozenset()
    assert conversation.shown[-1] == controller.held
    assert {name for one in session.inputs.values() for name in one.recipe.names} == set(inputs)
    assert conversation.events == [Notice.STARTED]
    assert conversation.negotiation.running
    kept = [name for name in session.outputs.names if name in INPUTS]
    assert kept
    assert not set(kept) & set(session.held)
    assert {one.word for one in session.unavailable} == {"TOO_LONG"}
    assert all("not verified" in one.hint for one in session.unavailable)


def test_a_list_that_is_taken_needs_no_reading_apart() -> None:
    inputs = (*INTS, *DOUBLES)
    controller = PureController(held=dict(numbered(inputs)))
    conversation = converse(Wishes(OUTPUTS, inputs), controller)
    assert conversation.sessions[0].held == {}
    assert conversation.shown[-1] == controller.held
    assert list(conversation.sessions[0].inputs) == [REGISTERS_KEY]
    assert len(controller.lists) == 2


def test_without_read_back_inputs_are_read_once_and_not_subscribed() -> None:
    controller = PureController(held=dict(numbered(INTS)))
    conversation = converse(Wishes(OUTPUTS[:1], INTS, read_back=False), controller)
    (session,) = conversation.sessions
    assert session.outputs.names == ("timestamp", OUTPUTS[0])
    assert session.held == {name: (value,) for name, value in controller.held.items()}
    assert not session.unavailable
    assert controller.lists == [INTS, INTS, session.outputs.names]


@pytest.mark.parametrize("read_back", [True, False])
def test_a_register_that_cannot_be_read_has_a_recipe_of_its_own(read_back: bool) -> None:
    inputs = (*INTS[:4], "speed_slider_mask", "speed_slider_fraction")
    controller = PureController(unreadable={INTS[1]}, held=dict(numbered(INTS[:4])))
    session = converse(Wishes((), inputs, read_back=read_back), controller).sessions[0]
    assert session.unread == {INTS[1], "speed_slider_mask", "speed_slider_fraction"}
    assert {key: one.recipe.names for key, one in session.inputs.items()} == {
        REGISTERS_KEY: (INTS[0], INTS[2], INTS[3]),
        INTS[1]: (INTS[1],),
        "speed_slider": ("speed_slider_mask", "speed_slider_fraction"),
    }


def test_once_written_a_register_joins_the_others_in_their_order() -> None:
    controller = PureController(unreadable={INTS[1], INTS[2]})
    conversation = converse(Wishes((), INTS[:4]), controller)
    negotiation = conversation.negotiation
    first = conversation.sessions[0]
    conversation.say(negotiation.join([INTS[1]]))
    conversation.say(negotiation.join([INTS[2]]))
    conversation.settle()
    latest = conversation.sessions[-1]
    assert {key: one.recipe.names for key, one in latest.inputs.items()} == {REGISTERS_KEY: INTS[:4]}
    assert latest.unread == {INTS[1], INTS[2]}
    assert all(negotiation.claims.accepted(one) for one in (*first.inputs.values(), *latest.inputs.values()))
    conversation.say(negotiation.join([INTS[1], "no_such_field", "speed_slider_mask"]))
    conversation.settle()
    assert conversation.sessions[-1] is latest


def test_a_late_claim_is_read_before_it_is_reported() -> None:
    controller = PureController(limit=OLD_LIST_LIMIT, in_use={DOUBLES[40]}, held=dict(numbered(DOUBLES)))
    conversation = converse(Wishes(OUTPUTS[:80], (*INTS, *DOUBLES)), controller)
    negotiation = conversation.negotiation
    first = conversation.sessions[0]
    assert DOUBLES[40] not in first.held
    controller.held[DOUBLES[40]] = 99.5
    controller.in_use.clear()
    conversation.say(negotiation.retry_claims())
    conversation.settle()
    assert conversation.events == [Notice.STARTED, Notice.INPUTS_CHANGED]
    latest = conversation.sessions[-1]
    assert latest.held[DOUBLES[40]] == (99.5,)
    assert latest.outputs is first.outputs
    assert negotiation.running


@pytest.mark.parametrize("resume", [False, True])
def test_a_pause_during_a_late_reading_is_kept(resume: bool) -> None:
    controller = PureController(in_use={INTS[0]})
    conversation = converse(Wishes((), INTS[:2], read_back=False), controller)
    negotiation = conversation.negotiation
    controller.in_use.clear()
    conversation.say(negotiation.retry_claims())
    while not negotiation.reading:
        if not controller.out:
            controller.package()
        conversation.hear(controller.out.popleft())
    assert negotiation.pause() is None
    if resume:
        assert negotiation.resume() is None
    conversation.settle()
    assert conversation.events[-1] is Notice.INPUTS_CHANGED
    assert negotiation.state is (State.RUNNING if resume else State.PAUSED)
    assert negotiation.session().held.keys() == set(INTS[:2])


def test_a_late_claim_while_paused_is_read_and_stays_paused() -> None:
    controller = PureController(in_use={INTS[0]}, held={INTS[0]: 5})
    conversation = converse(Wishes((), INTS[:2], read_back=False, running=False), controller)
    controller.in_use.clear()
    conversation.say(conversation.negotiation.retry_claims())
    conversation.settle()
    assert conversation.negotiation.state is State.PAUSED
    assert conversation.sessions[-1].held[INTS[0]] == (5,)


def test_a_probe_is_answered_anywhere_after_the_set_up() -> None:
    controller = PureController(in_use={INTS[0]})
    conversation = converse(Wishes((), INTS[:2], read_back=False), controller)
    negotiation = conversation.negotiation
    controller.in_use.clear()
    conversation.say(negotiation.retry_claims())
    conversation.say(negotiation.probe())
    conversation.settle()
    assert sorted(event.name for event in conversation.events) == ["INPUTS_CHANGED", "PROBED", "STARTED"]


def test_an_answer_to_an_abandoned_probe_is_not_taken_for_that_to_the_next() -> None:
    conversation = converse(Wishes(), PureController())
    negotiation = conversation.negotiation
    conversation.say(negotiation.probe())
    conversation.say(negotiation.probe())
    conversation.hear(conversation.controller.out.popleft())
    assert Notice.PROBED not in conversation.events
    conversation.hear(conversation.controller.out.popleft())
    assert conversation.events[-1] is Notice.PROBED


def test_no_probe_before_the_session() -> None:
    assert Negotiation(Wishes()).probe() is None


Draw = Callable[[st.SearchStrategy[Any]], Any]


class Story:
    """A conversation to which things happen: refusals, delays, freed inputs, pauses, writes."""

    def __init__(self, draw: Draw) -> None:
        self.draw = draw
        self.inputs: tuple[str, ...] = tuple(
            draw(st.lists(st.sampled_from(EVERY_INPUT), unique=True, max_size=120, min_size=1))
        )
        some = st.lists(st.sampled_from(self.inputs), max_size=5)
        self.controller = PureController(
            limit=draw(st.sampled_from((OLD_LIST_LIMIT, 65535))),
            in_use=set(draw(some)),
            unreadable={name for name in draw(some) if name.startswith("input_")},
            stray=lambda: draw(st.integers(0, 2)),
            swallows_start=draw(st.booleans()),
            held=dict(numbered(self.inputs)),
        )
        self.wishes = Wishes(
            OUTPUTS[: draw(st.integers(0, 96))],
            self.inputs,
            watchdog=draw(st.none() | st.sampled_from(self.inputs)),
            read_back=draw(st.booleans()),
            limited=draw(st.booleans()),
        )
        self.conversation = converse(self.wishes, self.controller)
        self.negotiation = self.conversation.negotiation
        self.written: set[str] = set()

    @property
    def session(self) -> Session:
        return self.conversation.sessions[-1]

    def go_on(self) -> None:
        negotiation = self.negotiation
        operations: tuple[Callable[[], m.ExecutableMessage | None], ...] = (
            self.talk,
            self.conversation.settle,
            self.free,
            self.write,
            negotiation.retry_claims,
            lambda: negotiation.join(sorted(self.written & self.session.unread)),
            negotiation.pause,
            negotiation.resume,
            negotiation.probe,
        )
        self.conversation.say(self.draw(st.sampled_from(operations))())

    def talk(self) -> None:
        if self.controller.out:
            self.conversation.hear(self.controller.out.popleft())

    def free(self) -> None:
        if self.controller.in_use:
            self.controller.in_use.discard(self.draw(st.sampled_from(sorted(self.controller.in_use))))

    def write(self) -> None:
        alone = [key for key, recipe in self.session.inputs.items() if key in recipe.recipe.names]
        self.written |= {key for key in alone if key.startswith("input_")}


@settings(max_examples=300, deadline=None)
@given(data=st.data())
def test_nothing_can_be_sent_that_is_neither_known_nor_alone(data: st.DataObject) -> None:
    """Whatever is refused, freed, joined, paused and delayed: one write changes what it writes and nothing else."""
    story = Story(data.draw)
    for _ in range(data.draw(st.integers(0, 12))):
        story.go_on()
    story.conversation.say(story.negotiation.resume())
    story.conversation.settle()
    assert story.negotiation.running
    session, claims = story.session, story.negotiation.claims
    known = {name: value for shown in story.conversation.shown for name, value in shown.items()}
    owners = {name: recipe for recipe in session.inputs.values() for name in recipe.recipe.names}
    assert len(owners) == sum(len(recipe.recipe.names) for recipe in session.inputs.values())
    assert owners.keys() | claims.refused.keys() == set(story.inputs)
    for name, recipe in owners.items():
        assert claims.accepted(recipe)
        if name in session.unread:
            alone = recipe.recipe.names == (name,)
            assert alone or not name.startswith("input_") or name in story.written
        else:
            assert known[name] == story.controller.held[name]
    if story.wishes.limited:
        assert all(len(",".join(names)) <= OLD_LIST_LIMIT for names in story.controller.lists)
