from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gatewayd.report.format import counted
from gatewayd.rtde import messages as m
from gatewayd.rtde.claims import HandshakeError
from gatewayd.rtde.fields import Series
from gatewayd.rtde.negotiation import Negotiation
from gatewayd.rtde.session import Wishes
from gatewayd.rtde.steps import NextStep, Notice, State
from tests.rtde.pure_controller import PureController

E_SERIES = m.ControllerVersion(5, 12, 0, 1101)
CB3 = m.ControllerVersion(3, 15, 8, 1)
DATA = m.DataPackage(1, bytes(16))
WISHES = Wishes(("output_int_register_0",), ("input_int_register_0",))
TO_OUTPUTS = (m.ProtocolVersionReply(True), E_SERIES)
TO_INPUTS = (*TO_OUTPUTS, m.OutputsSetup(1, ("DOUBLE", "INT32", "INT32")))
TO_START = (*TO_INPUTS, m.InputsSetup(1, ("INT32",)))
TO_RUNNING = (*TO_START, m.StartReply(True))


def talk(wishes: Wishes, replies: Sequence[m.ControllerMessage]) -> tuple[Negotiation, list[NextStep]]:
    negotiation = Negotiation(wishes)
    steps = [NextStep(negotiation.begin())]
    steps += [negotiation.handle(reply) for reply in replies]
    return negotiation, steps


def test_the_whole_way_in_version_2() -> None:
    negotiation, steps = talk(WISHES, TO_RUNNING)
    assert [step[:2] for step in steps] == [
        (m.RequestProtocolVersion(2), None),
        (m.GetControllerVersion(), None),
        (m.SetupOutputs(("timestamp", "output_int_register_0", "input_int_register_0"), 500.0), None),
        (m.SetupInputs(("input_int_register_0",)), None),
        (m.Start(), None),
        (None, Notice.STARTED),
    ]
    session = negotiation.session()
    assert (session.protocol, session.series, session.controller) == (2, Series.E, E_SERIES)
    assert session.outputs.names == ("timestamp", "output_int_register_0", "input_int_register_0")
    assert session.inputs["registers"].id == 1
    assert session.unavailable == ()
    assert not negotiation.waiting


def test_version_1_is_spoken_when_2_is_refused() -> None:
    """Version 1 can neither choose a frequency nor name an output recipe."""
    replies = (
        m.ProtocolVersionReply(False),
        m.ProtocolVersionReply(True),
        CB3,
        m.OutputsSetup(None, ("DOUBLE",)),
    )
    negotiation, steps = talk(Wishes(frequency=10.0), (*replies, m.StartReply(True)))
    assert [step.send for step in steps] == [
        m.RequestProtocolVersion(2),
        m.RequestProtocolVersion(1),
        m.GetControllerVersion(),
        m.SetupOutputs(("timestamp",)),
        m.Start(),
        None,
    ]
    assert negotiation.session().protocol == 1
    assert negotiation.session().period == 0.008


@pytest.mark.parametrize(
    "version, wanted, asked, period",
    [
        (E_SERIES, 0.0, 500.0, 0.002),
        (E_SERIES, 500.0, 500.0, 0.002),
        (E_SERIES, 200.0, 200.0, 0.004),
        (E_SERIES, 250.0, 250.0, 0.004),
        (E_SERIES, 10.0, 10.0, 0.1),
        (E_SERIES, 1000.0, 500.0, 0.002),
        (E_SERIES, 0.1, 1.0, 1.0),
        (CB3, 0.0, 125.0, 0.008),
        (CB3, 500.0, 125.0, 0.008),
        (CB3, 50.0, 50.0, 0.016),
        (m.ControllerVersion(10, 7, 0, 0), 0.0, 500.0, 0.002),
        (m.ControllerVersion(12, 0, 0, 0), 0.0, 500.0, 0.002),
        (m.ControllerVersion(4, 0, 0, 0), 0.0, 125.0, 0.008),
    ],
)
def test_the_controller_divides_its_rate_by_a_whole_number(
    version: m.ControllerVersion, wanted: float, asked: float, period: float
) -> None:
    replies = (m.ProtocolVersionReply(True), version, m.OutputsSetup(1, ("DOUBLE",)), m.StartReply(True))
    negotiation, steps = talk(Wishes(frequency=wanted), replies)
    assert steps[2].send == m.SetupOutputs(("timestamp",), asked)
    assert negotiation.session().period == pytest.approx(period)


def test_outputs_that_are_not_found_are_left_out_and_told() -> None:
    wishes = Wishes(("a", "b", "c"))
    replies = (*TO_OUTPUTS, m.OutputsSetup(0, ("DOUBLE", "NOT_FOUND", "INT32", "STRING")))
    negotiation, steps = talk(wishes, replies)
    assert steps[-1].send == m.SetupOutputs(("timestamp", "b"), 500.0)
    negotiation.handle(m.OutputsSetup(1, ("DOUBLE", "INT32")))
    negotiation.handle(m.StartReply(True))
    told = {one.field: one.word for one in negotiation.session().unavailable}
    assert told == {"a": "NOT_FOUND", "c": "STRING"}
    assert all(one.output and one.hint for one in negotiation.session().unavailable)


def test_inputs_in_use_are_told_with_their_likely_holder() -> None:
    wishes = Wishes(
        inputs=("input_int_register_0", "input_int_register_1", "tool_digital_output"), read_back=False
    )
    replies = (
        *TO_OUTPUTS,
        m.InputsSetup(0, ("INT32", "IN_USE")),
        m.InputsSetup(1, ("INT32",)),
        m.InputsSetup(0, ("NOT_FOUND",)),
        m.OutputsSetup(0, ("NOT_FOUND",)),
        m.OutputsSetup(1, ("DOUBLE",)),
        m.InputsSetup(2, ("INT32",)),
        m.StartReply(True),
    )
    negotiation, _ = talk(wishes, replies)
    unreadable, in_use, missing = negotiation.session().unavailable
    assert (unreadable.field, unreadable.output) == ("input_int_register_0", True)
    assert (in_use.field, in_use.output, in_use.word) == ("input_int_register_1", False, "IN_USE")
    assert "PROFINET" in in_use.hint
    assert (missing.field, missing.word) == ("tool_digital_output", "NOT_FOUND")


def test_claimed_later_the_session_has_the_new_recipe() -> None:
    negotiation, _ = talk(WISHES, (*TO_INPUTS, m.InputsSetup(0, ("IN_USE",)), m.StartReply(True)))
    before = negotiation.session()
    assert before.inputs == {}
    assert negotiation.retry_claims() == m.SetupInputs(("input_int_register_0",))
    assert negotiation.waiting
    assert negotiation.retry_claims() is None
    assert negotiation.handle(DATA)[:2] == (None, None)
    assert negotiation.handle(m.InputsSetup(1, ("INT32",)))[:2] == (None, Notice.INPUTS_CHANGED)
    assert negotiation.session().inputs["registers"].id == 1
    assert negotiation.session().unavailable == ()
    assert before.inputs == {}
    assert negotiation.retry_claims() is None


def test_retried_in_vain_nothing_is_told() -> None:
    negotiation, _ = talk(WISHES, (*TO_INPUTS, m.InputsSetup(0, ("IN_USE",)), m.StartReply(True)))
    negotiation.retry_claims()
    assert negotiation.handle(m.InputsSetup(0, ("IN_USE",)))[:2] == (None, None)


def test_data_is_as_good_as_the_answer_to_a_start() -> None:
    negotiation, steps = talk(WISHES, (*TO_START, DATA))
    assert steps[-1][:2] == (None, Notice.STARTED)
    assert negotiation.handle(m.StartReply(True))[:2] == (None, None)


def test_a_refused_start_ends_the_talk() -> None:
    negotiation, _ = talk(WISHES, TO_START)
    with pytest.raises(HandshakeError, match="refused to start"):
        negotiation.handle(m.StartReply(False))


@pytest.mark.parametrize(
    "replies, words",
    [
        ((m.ProtocolVersionReply(False),) * 2, "neither protocol version 2 nor 1"),
        ((*TO_OUTPUTS, m.OutputsSetup(0, ("NOT_FOUND",) * 3)), "none of the wanted outputs"),
        ((*TO_OUTPUTS, m.OutputsSetup(0, ("DOUBLE", "INT32", "INT32"))), "without naming a field"),
        ((*TO_OUTPUTS, m.OutputsSetup(1, ("DOUBLE",))), "1 type for 3 fields"),
    ],
)
def test_what_ends_the_talk(replies: Sequence[m.ControllerMessage], words: str) -> None:
    with pytest.raises(HandshakeError, match=words):
        talk(WISHES, replies)


@pytest.mark.parametrize(
    "replies, answer, words",
    [
        ((), m.StartReply(True), "StartReply while the answer to protocol version 2 was awaited"),
        (TO_OUTPUTS, m.PauseReply(True), "PauseReply while the answer to the output recipe was awaited"),
        (TO_RUNNING, E_SERIES, "ControllerVersion while data was awaited"),
        (TO_RUNNING, m.InputsSetup(1, ()), "InputsSetup while data was awaited"),
        (TO_RUNNING, m.ProtocolVersionReply(True), "ProtocolVersionReply while data was awaited"),
        (TO_RUNNING, m.OutputsSetup(1, ("DOUBLE",)), "OutputsSetup while data was awaited"),
        ((*TO_START, DATA), m.StartReply(False), "a refused start of the output that runs"),
    ],
)
def test_an_answer_that_nobody_awaits_changes_nothing(
    replies: Sequence[m.ControllerMessage], answer: m.ControllerMessage, words: str
) -> None:
    negotiation, _ = talk(WISHES, replies)
    state, waiting = negotiation.state, negotiation.waiting
    assert negotiation.handle(answer) == NextStep(strange=words, taken=False)
    assert (negotiation.state, negotiation.waiting) == (state, waiting)


@pytest.mark.parametrize("words", [(), ("INT32",) * 2])
def test_a_claim_answered_with_too_many_or_no_types_is_refused_and_asked_again(
    words: tuple[str, ...],
) -> None:
    negotiation, steps = talk(WISHES, (*TO_INPUTS, m.InputsSetup(1, words)))
    assert steps[-1] == NextStep(m.Start(), strange=f"{counted(len(words), 'type')} for 1 input")
    negotiation.handle(m.StartReply(True))
    assert [(one.field, one.word) for one in negotiation.session().unavailable] == [
        ("input_int_register_0", "REFUSED")
    ]
    assert negotiation.retry_claims() == m.SetupInputs(("input_int_register_0",))
    assert negotiation.handle(m.InputsSetup(2, ("INT32",))).event is Notice.INPUTS_CHANGED


TO_READING = (*TO_OUTPUTS, m.InputsSetup(1, ("INT32",)))
PIECE = m.OutputsSetup(1, ("INT32",))


@pytest.mark.parametrize(
    "answers, words",
    [
        ((m.OutputsSetup(1, ()),), "no types for 1 field of a reading"),
        ((m.OutputsSetup(0, ("INT32",)),), "a refused reading without a word for any field"),
        ((PIECE, m.StartReply(False)), "a refused start of a reading"),
    ],
)
def test_a_reading_that_comes_to_nothing_leaves_its_fields_unread_and_costs_no_session(
    answers: Sequence[m.ControllerMessage], words: str
) -> None:
    wishes = Wishes(("output_int_register_0",), ("input_int_register_0",), read_back=False)
    negotiation, steps = talk(wishes, (*TO_READING, *answers))
    assert steps[-1].strange == words
    assert steps[-1].send == m.SetupOutputs(("timestamp", "output_int_register_0"), 500.0)
    step = negotiation.handle(m.OutputsSetup(1, ("DOUBLE", "INT32")))
    assert step.send == m.SetupInputs(("input_int_register_0",)), "in a recipe of its own"
    negotiation.handle(m.InputsSetup(2, ("INT32",)))
    assert negotiation.handle(m.StartReply(True)).event is Notice.STARTED
    assert negotiation.session().unread == {"input_int_register_0"}
    (unread,) = negotiation.session().unavailable
    assert (unread.output, unread.word, unread.hint) == (
        True,
        "REFUSED",
        "the controller did not let it be read",
    )


TO_READ_LATER = (
    m.InputsSetup(2, ("INT32",)),
    m.PauseReply(True),
    PIECE,
    m.StartReply(True),
    m.DataPackage(1, bytes(4)),
    m.PauseReply(True),
)
"""An input that was in use is claimed and read: then the session's own recipe is set up again."""
SAME = m.OutputsSetup(3, ("DOUBLE", "INT32"))


def read_later() -> tuple[Negotiation, NextStep]:
    wishes = Wishes(("output_int_register_0",), ("input_int_register_0",), read_back=False)
    first = (*TO_OUTPUTS, m.InputsSetup(0, ("IN_USE",)), SAME, m.StartReply(True))
    negotiation, steps = talk(wishes, first)
    assert steps[-1].event is Notice.STARTED
    assert negotiation.retry_claims() == m.SetupInputs(("input_int_register_0",))
    return negotiation, [negotiation.handle(reply) for reply in TO_READ_LATER][-1]


@pytest.mark.parametrize(
    "answers, words",
    [
        ((m.OutputsSetup(3, ()),), "the same output recipe answered differently than before"),
        (
            (m.OutputsSetup(3, ("DOUBLE", "UINT32")),),
            "the same output recipe answered differently than before",
        ),
        (
            (m.OutputsSetup(0, ("DOUBLE", "NOT_FOUND")),),
            "the same output recipe answered differently than before",
        ),
        (
            (m.OutputsSetup(0, ("DOUBLE", "INT32")),),
            "the same output recipe answered differently than before",
        ),
        ((SAME, m.StartReply(False)), "a refused start of the output"),
    ],
)
def test_a_wrong_answer_within_a_session_costs_no_session(
    answers: Sequence[m.ControllerMessage], words: str
) -> None:
    """It is asked again; a controller that has nothing else to say ends the session, which has no values then."""
    negotiation, asked = read_later()
    assert asked.send == m.SetupOutputs(("timestamp", "output_int_register_0"), 500.0)
    *before, wrong = answers
    for answer in before:
        asked = negotiation.handle(answer)
    for _attempt in range(3):
        step = negotiation.handle(wrong)
        assert (step.send, step.strange) == (asked.send, words)
    if not before:
        negotiation.handle(SAME)
    assert negotiation.handle(m.StartReply(True)).event is Notice.INPUTS_CHANGED
    assert negotiation.session().held["input_int_register_0"] == (0,)
    assert not negotiation.waiting


def test_a_controller_that_refuses_for_ever_what_it_gave_before_ends_the_session() -> None:
    negotiation, _asked = read_later()
    for _attempt in range(3):
        assert negotiation.handle(m.OutputsSetup(3, ("DOUBLE", "UINT32"))).send is not None
    with pytest.raises(HandshakeError, match="differently than before, 4 times in a row"):
        negotiation.handle(m.OutputsSetup(3, ("DOUBLE", "UINT32")))


def test_a_refused_restart_after_a_pause_is_asked_again() -> None:
    negotiation, _ = talk(WISHES, TO_RUNNING)
    assert negotiation.pause() == m.Pause()
    negotiation.handle(m.PauseReply(True))
    assert negotiation.resume() == m.Start()
    step = negotiation.handle(m.StartReply(False))
    assert (step.send, step.strange) == (m.Start(), "a refused start of the output")
    assert negotiation.handle(m.StartReply(True)).event is Notice.RESUMED


@pytest.mark.parametrize("package", [m.DataPackage(2, bytes(16)), m.DataPackage(1, bytes(17))])
def test_only_data_of_the_agreed_recipe_proves_a_start(package: m.DataPackage) -> None:
    negotiation, steps = talk(WISHES, (*TO_START, package))
    assert steps[-1] == NextStep()
    assert not negotiation.running


@pytest.mark.parametrize("replies", [(), TO_OUTPUTS, TO_INPUTS, TO_RUNNING], ids=len)
def test_data_out_of_season_does_no_harm(replies: Sequence[m.ControllerMessage]) -> None:
    negotiation, _ = talk(WISHES, replies)
    state = negotiation.state
    assert negotiation.handle(DATA)[:2] == (None, None)
    assert negotiation.state is state


def test_pause_and_resume() -> None:
    negotiation, _ = talk(WISHES, TO_RUNNING)
    assert negotiation.pause() == m.Pause()
    assert negotiation.handle(DATA)[:2] == (None, None)
    assert negotiation.handle(m.PauseReply(True))[:2] == (None, Notice.PAUSED)
    assert negotiation.pause() is None
    assert not negotiation.running
    assert negotiation.resume() == m.Start()
    assert negotiation.handle(m.StartReply(True))[:2] == (None, Notice.RESUMED)
    assert negotiation.running


def test_a_pause_during_the_set_up_is_kept() -> None:
    negotiation, _ = talk(WISHES, TO_INPUTS)
    assert negotiation.pause() is None
    assert negotiation.handle(m.InputsSetup(1, ("INT32",)))[:2] == (None, Notice.STARTED)
    assert negotiation.state is State.PAUSED


def test_a_pause_while_starting_and_a_resume_while_pausing_are_kept() -> None:
    negotiation, _ = talk(WISHES, TO_START)
    assert negotiation.pause() is None
    assert negotiation.handle(m.StartReply(True))[:2] == (m.Pause(), Notice.STARTED)
    assert negotiation.resume() is None
    assert negotiation.handle(m.PauseReply(True))[:2] == (m.Start(), Notice.PAUSED)


def test_a_session_can_begin_paused() -> None:
    negotiation, steps = talk(Wishes(running=False), (*TO_OUTPUTS, m.OutputsSetup(1, ("DOUBLE",))))
    assert steps[-1][:2] == (None, Notice.STARTED)
    assert negotiation.state is State.PAUSED


def test_inputs_can_be_claimed_while_paused() -> None:
    wishes = Wishes(inputs=("input_int_register_0",), running=False)
    replies = (*TO_OUTPUTS, m.OutputsSetup(1, ("DOUBLE", "INT32")), m.InputsSetup(0, ("IN_USE",)))
    negotiation, _ = talk(wishes, replies)
    assert negotiation.retry_claims()
    assert negotiation.handle(m.InputsSetup(1, ("INT32",))).event is Notice.INPUTS_CHANGED


def test_what_is_awaited_is_put_in_words() -> None:
    negotiation, _ = talk(WISHES, TO_OUTPUTS)
    assert negotiation.awaited == "the answer to the output recipe"
    negotiation, _ = talk(WISHES, (*TO_INPUTS, m.InputsSetup(0, ("IN_USE",)), m.StartReply(True)))
    negotiation.retry_claims()
    assert negotiation.awaited == "the answer to an input recipe"


WORDS = st.sampled_from(("DOUBLE", "INT32", "NOT_FOUND", "IN_USE", "STRING", ""))
ANYTHING = st.one_of(
    st.builds(m.ProtocolVersionReply, st.booleans()),
    st.sampled_from((E_SERIES, CB3)),
    st.builds(m.OutputsSetup, st.none() | st.integers(0, 2), st.lists(WORDS, max_size=5).map(tuple)),
    st.builds(m.InputsSetup, st.integers(0, 255), st.lists(WORDS, max_size=4).map(tuple)),
    st.builds(m.StartReply, st.booleans()),
    st.builds(m.PauseReply, st.booleans()),
    st.builds(m.DataPackage, st.none() | st.integers(0, 2), st.binary(max_size=20)),
)


@settings(max_examples=500, deadline=None)
@given(data=st.data())
def test_whatever_a_controller_answers_ends_the_talk_in_order_or_goes_on(data: st.DataObject) -> None:
    """Right answers up to some point, then anything: nothing but a HandshakeError is raised, nothing is asked twice."""
    draw = data.draw
    inputs = tuple(
        f"input_{kind}_register_{n}" for kind in ("int", "double") for n in range(draw(st.integers(0, 48)))
    )
    controller = PureController(
        limit=draw(st.sampled_from((100, 2048, 65535))), in_use=set(inputs[:2]), unreadable=set(inputs[1:3])
    )
    negotiation = Negotiation(Wishes(("output_int_register_0",), inputs, read_back=draw(st.booleans())))
    request: m.ExecutableMessage | None = negotiation.begin()
    with suppress(HandshakeError):
        for _ in range(draw(st.integers(0, 40))):
            if request is not None:
                controller.ask(request)
            if draw(st.integers(0, 9)) == 0 or not controller.out:
                controller.out.appendleft(draw(ANYTHING))
            request = negotiation.handle(controller.out.popleft()).send
            if request is None and draw(st.booleans()):
                request = draw(
                    st.sampled_from((negotiation.retry_claims, negotiation.pause, negotiation.resume))
                )()
            if negotiation.state is State.RUNNING:
                assert negotiation.session().inputs.keys() == negotiation.claims.recipes.keys()


@pytest.mark.parametrize("version", [1, 2])
def test_a_forced_protocol_version_is_asked_for_alone(version: int) -> None:
    wishes = Wishes(("output_int_register_0",), protocol=version)
    negotiation, steps = talk(wishes, (m.ProtocolVersionReply(True),))
    assert [step.send for step in steps] == [m.RequestProtocolVersion(version), m.GetControllerVersion()]
    negotiation, _ = talk(wishes, ())
    with pytest.raises(HandshakeError, match=f"does not speak protocol version {version}, which was forced"):
        negotiation.handle(m.ProtocolVersionReply(False))


def test_recipes_change_while_paused_on_the_same_connection() -> None:
    wishes = Wishes(("output_int_register_0",), recipes={"a": ("input_int_register_0",)}, running=False)
    negotiation, steps = talk(wishes, TO_START)
    assert steps[-1][:2] == (None, Notice.STARTED)
    assert negotiation.state is State.PAUSED
    new = Wishes(
        ("actual_q",), recipes={"a": ("input_int_register_0",), "b": ("input_int_register_1",)}, running=False
    )
    step = negotiation.change(new)
    assert step.send == m.SetupOutputs(
        ("timestamp", "actual_q", "input_int_register_0", "input_int_register_1"), 500.0
    )
    step = negotiation.handle(m.OutputsSetup(1, ("DOUBLE", "VECTOR6D", "INT32", "INT32")))
    assert step.send == m.SetupInputs(("input_int_register_1",))
    step = negotiation.handle(m.InputsSetup(2, ("INT32",)))
    assert step[:2] == (None, Notice.CHANGED)
    session = negotiation.session()
    assert {key: held.id for key, held in session.inputs.items()} == {"a": 1, "b": 2}
    assert session.outputs.names[1] == "actual_q"
    assert negotiation.resume() == m.Start()


def test_a_change_that_leaves_no_output_fails() -> None:
    negotiation, _ = talk(Wishes(running=False), (*TO_OUTPUTS, m.OutputsSetup(1, ("DOUBLE",))))
    negotiation.change(Wishes(("actual_q",), running=False))
    with pytest.raises(HandshakeError, match="none of the wanted outputs"):
        negotiation.handle(m.OutputsSetup(0, ("NOT_FOUND", "NOT_FOUND")))
