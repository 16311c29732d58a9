from __future__ import annotations

import pytest

from gatewayd.core.definition import Direction, ValueKind, Variable
from gatewayd.links.robot.availability import unavailable
from gatewayd.rtde.claims import REGISTERS_KEY, InputRecipe
from gatewayd.rtde.messages import ControllerVersion
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.session import Session, Unavailable
from gatewayd.rtde.types import DataType

INT32 = (-(2**31), 2**31 - 1)


def session(
    outputs: dict[str, DataType], inputs: dict[str, DataType], refused: tuple[Unavailable, ...] = ()
) -> Session:
    recipe = Recipe(tuple(inputs), tuple(inputs.values()))
    return Session(
        ControllerVersion(5, 12, 0, 0),
        None,
        2,
        0.002,
        Recipe(tuple(outputs), tuple(outputs.values())),
        {REGISTERS_KEY: InputRecipe(REGISTERS_KEY, 1, recipe)},
        refused,
    )


def integer(direction: Direction, element: int | None = None) -> Variable:
    low, high = INT32
    return Variable(1, "v", direction, ValueKind.INT, "f", element=element, low=low, high=high)


def test_a_refused_field_is_refused_in_its_own_direction_only() -> None:
    refused = (Unavailable("f", output=False, word="IN_USE", hint="a PLC"),)
    variables = (integer(Direction.INPUT), integer(Direction.OUTPUT))
    assert unavailable(session({"f": DataType.INT32}, {}, refused), variables) == {0: "IN_USE: a PLC"}


@pytest.mark.parametrize("answered", [DataType.UINT32, DataType.DOUBLE, DataType.BOOL, DataType.UINT64])
def test_another_type_than_the_mappings_is_left_alone(answered: DataType) -> None:
    reasons = unavailable(session({}, {"f": answered}), [integer(Direction.INPUT)])
    assert list(reasons) == [0]
    assert answered.word in reasons[0]


@pytest.mark.parametrize(
    "variable, fitting, wrong",
    [
        (integer(Direction.OUTPUT), DataType.INT32, DataType.UINT8),
        (integer(Direction.OUTPUT, element=5), DataType.VECTOR6INT32, DataType.INT32),
        (Variable(1, "v", Direction.OUTPUT, ValueKind.BOOL, "f", bit=31), DataType.UINT32, DataType.UINT8),
        (Variable(1, "v", Direction.OUTPUT, ValueKind.BOOL, "f"), DataType.BOOL, DataType.DOUBLE),
        (
            Variable(1, "v", Direction.OUTPUT, ValueKind.FLOAT, "f", element=2),
            DataType.VECTOR3D,
            DataType.BOOL,
        ),
        (Variable(1, "v", Direction.OUTPUT, ValueKind.FLOAT, "f"), DataType.DOUBLE, DataType.INT32),
    ],
)
def test_each_kind_knows_its_types(variable: Variable, fitting: DataType, wrong: DataType) -> None:
    assert unavailable(session({"f": fitting}, {}), [variable]) == {}
    assert list(unavailable(session({"f": wrong}, {}), [variable])) == [0]


@pytest.mark.parametrize("answered, fits", [(DataType.DOUBLE, True), (DataType.VECTOR3D, False)])
def test_a_declared_type_is_to_be_the_controllers(answered: DataType, fits: bool) -> None:
    """Also where the answer could carry the value: what else the file says of the field may be wrong as well."""
    variable = Variable(1, "v", Direction.OUTPUT, ValueKind.FLOAT, "f", element=0)
    reasons = unavailable(session({"f": answered}, {}), [variable], {"f": "DOUBLE"})
    assert reasons == (
        {} if fits else {0: "the controller answers VECTOR3D, but the mapping declares DOUBLE"}
    )
