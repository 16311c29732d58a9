from __future__ import annotations

from gatewayd.cli.rtde.conditions import parse_condition
from gatewayd.cli.rtde.triggers import Conditions
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.types import DataType

RECIPE = Recipe(["a", "b"], [DataType.INT32, DataType.INT32])


def test_the_fields_of_all_conditions_are_needed_once() -> None:
    conditions = Conditions(None, parse_condition("a == 1 and b"), parse_condition("b == 2"), once=False)
    assert conditions.fields == ("a", "b")
    assert Conditions(None, None, None, once=False).fields == ()


def test_each_way_to_start_and_stop() -> None:
    cases = {
        Conditions(None, None, None, once=False): [True, True, True, True],
        Conditions(parse_condition("a"), None, None, once=False): [False, True, False, True],
        Conditions(parse_condition("a"), None, None, once=True): [False, True, False, False],
        Conditions(None, parse_condition("a"), None, once=False): [False, True, True, True],
        Conditions(None, None, parse_condition("a"), once=False): [True, True, False, False],
    }
    for conditions, expected in cases.items():
        trigger = conditions.trigger(RECIPE)
        assert [trigger.active((value, 0)) for value in (0, 1, 0, 1)] == expected
