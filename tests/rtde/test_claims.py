from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.rtde.catalogue import OLD_LIST_LIMIT
from gatewayd.rtde.claims import (
    REFUSED,
    REGISTERS_KEY,
    UNASKED,
    WATCHDOG_KEY,
    Claims,
    ClaimStanding,
    HandshakeError,
    recipe_key,
    sort_types,
)
from gatewayd.rtde.fields import INPUTS
from gatewayd.rtde.messages import IN_USE, NOT_FOUND, InputsSetup, SetupInputs
from gatewayd.rtde.types import DataType

WATCHDOG = "input_int_register_23"
REGISTERS = tuple(f"input_int_register_{number}" for number in range(6))


class Controller:
    """Answers input setups: what is taken is taken."""

    def __init__(
        self, taken: set[str] | None = None, missing: set[str] | None = None, limit: int = 65535
    ) -> None:
        self.limit = limit
        self.taken = taken or set()
        self.missing = missing or set()
        self.ids = 0
        self.asked: list[tuple[str, ...]] = []

    def word(self, name: str) -> str:
        if name in self.missing or name not in INPUTS:
            return NOT_FOUND
        return IN_USE if name in self.taken else INPUTS[name].type.word

    def converse(self, claims: Claims) -> None:
        while (request := claims.request()) is not None:
            self.asked.append(request.names)
            types = tuple(map(self.word, request.names))
            good = not {NOT_FOUND, IN_USE} & set(types) and len(",".join(request.names)) <= self.limit
            self.ids += good
            claims.answer(InputsSetup(self.ids if good else 0, types))


def held(claims: Claims) -> dict[str, tuple[str, ...]]:
    return {key: claimed.recipe.names for key, claimed in claims.recipes.items()}


@pytest.mark.parametrize(
    "name, key",
    [
        ("input_int_register_0", REGISTERS_KEY),
        ("input_bit_registers0_to_31", REGISTERS_KEY),
        ("input_double_register_47", REGISTERS_KEY),
        ("speed_slider_mask", "speed_slider"),
        ("speed_slider_fraction", "speed_slider"),
        ("standard_digital_output_mask", "standard_digital_output"),
        ("configurable_digital_output", "configurable_digital_output"),
        ("tool_digital_output_mask", "tool_digital_output"),
        ("standard_analog_output_type", "standard_analog_output"),
        ("standard_analog_output_1", "standard_analog_output"),
        ("external_force_torque", "external_force_torque"),
    ],
)
def test_what_must_arrive_together_shares_a_recipe(name: str, key: str) -> None:
    assert recipe_key(name) == key


def test_all_registers_are_claimed_with_one_request_and_the_watchdog_apart() -> None:
    claims = Claims((*REGISTERS, "speed_slider_mask", "speed_slider_fraction"), REGISTERS[5])
    controller = Controller()
    controller.converse(claims)
    assert held(claims) == {
        REGISTERS_KEY: REGISTERS[:5],
        "speed_slider": ("speed_slider_mask", "speed_slider_fraction"),
        WATCHDOG_KEY: (REGISTERS[5],),
    }
    assert len(controller.asked) == 3
    assert [claimed.id for claimed in claims.recipes.values()] == [1, 2, 3]
    assert not claims.refused


def test_a_watchdog_need_not_be_among_the_fields() -> None:
    claims = Claims((), "input_int_register_9")
    Controller().converse(claims)
    assert held(claims) == {WATCHDOG_KEY: ("input_int_register_9",)}


def test_no_fields_ask_for_nothing() -> None:
    """Controllers do not answer an empty input recipe."""
    assert Claims(()).request() is None


def test_refused_fields_cost_only_themselves() -> None:
    claims = Claims((*REGISTERS, "tool_digital_output"))
    Controller({REGISTERS[1], REGISTERS[4]}, {"tool_digital_output"}).converse(claims)
    assert held(claims) == {REGISTERS_KEY: (REGISTERS[0], REGISTERS[2], REGISTERS[3], REGISTERS[5])}
    assert claims.refused == {
        REGISTERS[1]: IN_USE,
        REGISTERS[4]: IN_USE,
        "tool_digital_output": NOT_FOUND,
    }
    assert claims.retriable


def test_a_field_that_is_freed_joins_the_rest_in_one_new_recipe() -> None:
    claims = Claims(REGISTERS)
    controller = Controller({REGISTERS[1], REGISTERS[4]})
    controller.converse(claims)
    claims.take_change()
    controller.taken = {REGISTERS[4]}
    claims.retry()
    controller.converse(claims)
    assert claims.take_change()
    assert held(claims) == {REGISTERS_KEY: tuple(name for name in REGISTERS if name != REGISTERS[4])}
    assert claims.recipes[REGISTERS_KEY].id == 2
    assert claims.refused == {REGISTERS[4]: IN_USE}


def test_asking_again_in_vain_costs_one_request_and_no_id() -> None:
    claims = Claims(REGISTERS)
    controller = Controller({REGISTERS[1]})
    controller.converse(claims)
    before = claims.recipes[REGISTERS_KEY]
    claims.take_change()
    controller.asked.clear()
    claims.retry()
    controller.converse(claims)
    assert controller.asked == [REGISTERS]
    assert claims.recipes[REGISTERS_KEY] is before
    assert not claims.take_change()


def test_a_missing_field_is_not_asked_for_again() -> None:
    claims = Claims(("tool_digital_output",))
    controller = Controller(missing={"tool_digital_output"})
    controller.converse(claims)
    claims.retry()
    assert claims.request() is None
    assert not claims.retriable


def test_a_recipe_refused_without_a_reason_is_retried_and_does_not_end_the_talk() -> None:
    claims = Claims((*REGISTERS, "speed_slider_mask"))
    assert claims.request()
    claims.answer(InputsSetup(0, ("INT32",) * 6))
    assert claims.request()
    claims.answer(InputsSetup(1, ("UINT32",)))
    assert set(claims.refused.values()) == {REFUSED}
    assert claims.retriable
    assert held(claims) == {"speed_slider": ("speed_slider_mask",)}


def test_a_type_that_is_not_known_costs_only_its_field() -> None:
    claims = Claims(REGISTERS[:2])
    assert claims.request()
    claims.answer(InputsSetup(1, ("INT32", "STRING")))
    request = claims.request()
    assert request is not None
    assert request.names == REGISTERS[:1]
    assert claims.refused == {REGISTERS[1]: "STRING"}


def test_after_255_recipes_the_connection_is_used_up() -> None:
    claims = Claims(REGISTERS[:2])
    controller = Controller({REGISTERS[1]})
    controller.converse(claims)
    for _ in range(254):
        assert not claims.exhausted
        controller.taken = set()
        claims.retry()
        controller.converse(claims)
        claims._groups[0].refused[REGISTERS[1]] = IN_USE
    claims.retry()
    assert claims.request() is None
    assert claims.exhausted


MANY = tuple(name for name in INPUTS if name.startswith("input_"))


@pytest.mark.parametrize("limited", [False, True], ids=["refused", "known before"])
def test_a_list_that_is_too_long_is_split(limited: bool) -> None:
    """A refusal that names no field is one of the list where it is long; a short one is asked for as it is."""
    claims = Claims((*MANY, "speed_slider_mask"), limited=limited)
    controller = Controller(limit=OLD_LIST_LIMIT)
    controller.converse(claims)
    assert all(len(",".join(names)) <= OLD_LIST_LIMIT for names in controller.asked[not limited :])
    assert list(held(claims)) == [REGISTERS_KEY, "registers 2", "speed_slider"]
    assert held(claims)[REGISTERS_KEY] + held(claims)["registers 2"] == MANY
    assert not claims.refused


def test_a_separated_register_leaves_no_recipe_that_carries_it() -> None:
    claims = Claims(REGISTERS)
    controller = Controller({REGISTERS[4]})
    controller.converse(claims)
    claims.separate([REGISTERS[1], REGISTERS[4]])
    assert claims.recipes == {}
    controller.converse(claims)
    rest = (REGISTERS[0], *REGISTERS[2:4], REGISTERS[5])
    assert held(claims) == {REGISTERS_KEY: rest, REGISTERS[1]: (REGISTERS[1],)}
    assert claims.refused == {REGISTERS[4]: IN_USE}
    controller.taken.clear()
    claims.retry()
    controller.converse(claims)
    assert held(claims)[REGISTERS[4]] == (REGISTERS[4],)


def test_recipes_of_before_stay_valid_and_those_of_others_never_are() -> None:
    claims, other = Claims(REGISTERS), Claims(REGISTERS)
    controller = Controller()
    controller.converse(claims)
    Controller().converse(other)
    former = claims.recipes[REGISTERS_KEY]
    claims.separate(REGISTERS[:1])
    controller.converse(claims)
    assert claims.accepted(former)
    assert all(map(claims.accepted, claims.recipes.values()))
    assert not claims.accepted(other.recipes[REGISTERS_KEY])


def test_joined_registers_keep_their_order_within_the_list_limit() -> None:
    claims = Claims(MANY, limited=True)
    claims.separate(MANY[:3])
    controller = Controller(limit=OLD_LIST_LIMIT)
    controller.converse(claims)
    claims.join(MANY[:3])
    controller.converse(claims)
    assert all(len(",".join(names)) <= OLD_LIST_LIMIT for names in controller.asked)
    assert sorted(name for names in held(claims).values() for name in names) == sorted(MANY)
    assert all(names == tuple(sorted(names, key=MANY.index)) for names in held(claims).values())
    assert not set(MANY[:3]) & held(claims).keys()


def test_a_refused_join_leaves_the_register_its_own_recipe() -> None:
    claims = Claims(REGISTERS)
    claims.separate(REGISTERS[:1])
    controller = Controller()
    controller.converse(claims)
    before = held(claims)
    claims.join(REGISTERS[:1])
    assert claims.request()
    claims.answer(InputsSetup(0, ("INT32",) * 6))
    controller.converse(claims)
    assert held(claims) == before
    assert not claims.refused


def test_joins_leave_ids_for_inputs_that_become_free() -> None:
    claims = Claims(REGISTERS)
    claims.separate(REGISTERS[:1])
    Controller().converse(claims)
    claims._used = 191
    claims.join(REGISTERS[:1])
    assert claims.request() is None
    assert not claims.exhausted


@pytest.mark.parametrize("words", [(), ("INT32",), ("INT32",) * 3])
def test_an_answer_without_a_type_for_each_name_is_a_refusal_and_asked_again(words: tuple[str, ...]) -> None:
    claims = Claims(REGISTERS[:2])
    claims.request()
    claims.answer(InputsSetup(1, words))
    assert claims.refused == dict.fromkeys(REGISTERS[:2], REFUSED)
    assert not claims.recipes
    assert claims.request() is None
    claims.retry()
    assert claims.request() == SetupInputs(tuple(REGISTERS[:2]))


def test_an_answer_that_nobody_asked_for_is_an_error() -> None:
    with pytest.raises(HandshakeError, match="not asked for"):
        Claims(()).answer(InputsSetup(1, ()))


def test_types_are_told_from_error_words() -> None:
    assert sort_types(("a", "b", "c"), ("BOOL", "IN_USE", "odd")) == (
        [DataType.BOOL],
        {"b": "IN_USE", "c": "odd"},
    )


@given(
    wanted=st.lists(st.sampled_from(sorted(INPUTS)), unique=True, max_size=30),
    rounds=st.lists(st.sets(st.sampled_from(sorted(INPUTS)), max_size=60), min_size=1, max_size=6),
    missing=st.sets(st.sampled_from(sorted(INPUTS)), max_size=20),
    watchdog=st.none() | st.sampled_from(sorted(INPUTS)),
)
def test_whatever_is_free_is_held_and_nothing_else(
    wanted: list[str], rounds: list[set[str]], missing: set[str], watchdog: str | None
) -> None:
    """What was once claimed stays claimed; each field is either held in exactly one newest recipe or refused."""
    claims = Claims(wanted, watchdog)
    controller = Controller(missing=missing)
    everything = {*wanted, *((watchdog,) if watchdog else ())}
    ours: set[str] = set()
    for taken in rounds:
        controller.taken = taken - ours
        controller.converse(claims)
        names = [name for claimed in claims.recipes.values() for name in claimed.recipe.names]
        assert len(names) == len(set(names))
        assert set(names) == everything - missing - controller.taken
        assert set(claims.refused) == everything - set(names)
        ours = set(names)
        claims.retry()


def test_named_recipes_are_claimed_as_they_are() -> None:
    """A field may be in several; one that cannot be had costs its recipe this field alone."""
    named = {
        "a": (REGISTERS[0], REGISTERS[1]),
        "registers": (REGISTERS[1], "speed_slider_mask"),
        REGISTERS[2]: (REGISTERS[3],),
    }
    controller = Controller(taken={REGISTERS[0]})
    claims = Claims((REGISTERS[5],), recipes={key: named[key] for key in ("a", REGISTERS[2])})
    controller.converse(claims)
    assert held(claims) == {
        REGISTERS_KEY: (REGISTERS[5],),
        "a": (REGISTERS[1],),
        REGISTERS[2]: (REGISTERS[3],),
    }
    controller.taken.clear()
    claims.retry()
    controller.converse(claims)
    assert held(claims)["a"] == named["a"]
    alone = Claims((), recipes={"registers": named["registers"]})
    controller.converse(alone)
    alone.separate([REGISTERS[1]])
    controller.converse(alone)
    assert held(alone) == {"registers": named["registers"]}


def test_a_named_recipe_that_is_too_long_a_list_is_refused_and_not_split() -> None:
    names = tuple(name for name in INPUTS if name.startswith("input_"))
    controller = Controller(limit=OLD_LIST_LIMIT)
    claims = Claims((), recipes={"long": names}, limited=True)
    controller.converse(claims)
    assert controller.asked == [names]
    assert held(claims) == {}
    assert set(claims.refused.values()) == {REFUSED}


@given(
    st.dictionaries(st.sampled_from("abc"), st.lists(st.sampled_from(REGISTERS), min_size=1, unique=True)),
    st.dictionaries(st.sampled_from("abc"), st.lists(st.sampled_from(REGISTERS), min_size=1, unique=True)),
    st.sets(st.sampled_from(REGISTERS)),
)
def test_named_recipes_change_and_what_stays_keeps_its_id(
    first: dict[str, list[str]], second: dict[str, list[str]], taken: set[str]
) -> None:
    controller = Controller(taken)
    before = {key: tuple(names) for key, names in first.items()}
    after = {key: tuple(names) for key, names in second.items()}
    claims = Claims((), recipes=before)
    controller.converse(claims)
    ids = {key: recipe.id for key, recipe in claims.recipes.items()}
    claims.change(after)
    controller.converse(claims)
    free = {key: tuple(name for name in names if name not in taken) for key, names in after.items()}
    assert held(claims) == {key: names for key, names in free.items() if names}
    for key, recipe in claims.recipes.items():
        assert (recipe.id == ids.get(key)) == (before.get(key) == after[key])


def test_claims_on_request_ask_for_nothing_by_themselves() -> None:
    claims = Claims(REGISTERS, limited=True, on_request=True)
    assert claims.request() is None
    assert (claims.standing, claims.retriable) == (ClaimStanding.UNASKED, False)
    assert set(claims.refused) == set(REGISTERS)
    assert set(claims.refused.values()) == {UNASKED}
    claims.retry()
    assert claims.busy
    Controller().converse(claims)
    assert claims.standing is ClaimStanding.HELD
    assert held(claims) == {REGISTERS_KEY: REGISTERS}
    assert not claims.refused


def test_a_claim_on_request_that_is_refused_is_not_repeated_by_itself() -> None:
    claims = Claims(REGISTERS, WATCHDOG, on_request=True)
    claims.retry()
    Controller(taken={*REGISTERS, WATCHDOG}).converse(claims)
    assert (claims.standing, claims.retriable) == (ClaimStanding.REFUSED, False)
    claims.retry()
    Controller().converse(claims)
    assert claims.standing is ClaimStanding.HELD


def test_the_first_field_that_there_is_decides() -> None:
    controller = Controller(taken={REGISTERS[1]}, missing={REGISTERS[0]})
    claims = Claims(REGISTERS, on_request=True)
    claims.retry()
    controller.converse(claims)
    assert claims.standing is ClaimStanding.PARTIAL
    assert not claims.retriable, "the others are to be given back, not completed"
    controller = Controller(taken={REGISTERS[2]}, missing={REGISTERS[0]})
    claims = Claims(REGISTERS, on_request=True)
    claims.retry()
    controller.converse(claims)
    assert (claims.standing, claims.retriable) == (ClaimStanding.HELD, True)


def test_registers_that_cannot_be_read_are_set_apart_without_being_asked_for() -> None:
    claims = Claims(REGISTERS, on_request=True)
    claims.separate([REGISTERS[2]])
    assert claims.request() is None
    claims.retry()
    Controller().converse(claims)
    assert claims.standing is ClaimStanding.HELD
    assert held(claims)[REGISTERS[2]] == (REGISTERS[2],)
