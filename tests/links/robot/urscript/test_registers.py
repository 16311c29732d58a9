"""Which variables a robot program has as registers."""

from __future__ import annotations

from gatewayd.links.robot.urscript.registers import others, registers
from tests.links.robot.urscript.scripts import plan_of, shipped

VARIABLES = """\
  low:    {robot: input_bit_register_31, modbus: 0.0, owner: plc}
  high:   {robot: input_bit_register_32, modbus: 0.1, owner: plc}
  upper:  {robot: output_bit_register_64, modbus: 90.2}
  ints:   {robot: input_int_register_3..5, modbus: 10, owner: plc}
  real:   {robot: output_double_register_23, modbus: 20}
  word:   {robot: output_bit_registers0_to_31, modbus: 30}
  part:   {robot: output_int_register_1.4, modbus: 32.0}
  joints: {robot: actual_q, modbus: 40}
"""


def test_registers_are_named_by_the_number_that_a_script_takes() -> None:
    found = {each.name: (each.register, each.number) for each in registers(plan_of(VARIABLES).cell)}
    assert found == {
        "low": ("input_boolean_register", 31),
        "high": ("input_boolean_register", 32),
        "upper": ("output_boolean_register", 64),
        "ints": ("input_integer_register", 3),
        "real": ("output_float_register", 23),
    }


def test_families_are_one_with_an_index() -> None:
    families = {each.name: len(each.variables) for each in registers(plan_of(VARIABLES).cell) if each.indexed}
    assert families == {"ints": 3}


def test_whole_words_bits_of_numbers_and_fields_are_no_registers_of_a_program() -> None:
    assert others(plan_of(VARIABLES).cell) == ("word", "part", "joints")


def test_registers_of_a_family_follow_each_other() -> None:
    """That is what an index is added to, across the two words of bits as well."""
    for register in registers(shipped("full-image.yaml").cell):
        numbers = [
            int(variable.field.rpartition("_")[2])
            if variable.bit is None
            else variable.bit + 32 * ("32_to" in variable.field)
            for variable in register.variables
        ]
        assert numbers == list(range(register.number, register.number + len(numbers)))
