"""What the Modbus server's kind says of a mapping."""

from __future__ import annotations

from gatewayd.links.modbus_server.language import LANGUAGE
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.loader import load


def cell(*lines: str) -> ExpandedCell:
    text = (
        "gatewayd: 1\ncell: c\nrobot: {host: r}\n"
        "writers: {plc: {modbus: [192.0.2.1, 198.51.100.0/24]}, line: {canopen: rpdo}}\nvariables:\n"
    )
    return load((text + "".join(f"  {line}\n" for line in lines)).encode(), "f").cell


def test_writers_have_addresses() -> None:
    plc, line = (part.spec for part in cell().document.writers.values())
    assert (LANGUAGE.knows(plc), LANGUAGE.knows(line)) == (True, False)
    assert LANGUAGE.names(plc) == ["192.0.2.1", "198.51.100.0/24"]
    assert (LANGUAGE.ways_of_writer(plc), LANGUAGE.ways_of_writer(line)) == (
        frozenset({"Modbus"}),
        frozenset(),
    )


def test_one_request_writes_what_lies_side_by_side() -> None:
    found = cell(
        "a: {robot: input_int_register_0, modbus: 10}",
        "b: {robot: input_int_register_1, modbus: 12}",
        "c: {robot: input_int_register_2, modbus: 20}",
    )
    writer = found.document.writers["plc"].spec
    assert LANGUAGE.writes_whole(writer, found.variables[:2], found)
    assert not LANGUAGE.writes_whole(writer, found.variables, found)
    apart = LANGUAGE.apart(found.variables, found)
    assert apart is not None
    assert apart.message == "`c` lies apart"


def test_several_places_make_a_list() -> None:
    variable, other = cell("a: {robot: robot_mode, modbus: 10}", "b: {robot: robot_mode}").variables
    assert LANGUAGE.more_places(variable) == "modbus: [10, ...]"
    assert LANGUAGE.more_places(other) == "modbus: [100, ...]"
