"""Typed parts that know where they stand."""

from __future__ import annotations

from gatewayd.links.modbus_server.sections import Modbus
from gatewayd.links.robot.sections import RobotSection
from gatewayd.mapping.document import Document
from gatewayd.mapping.reader import read_document
from gatewayd.mapping.source import parse

HEAD = "gatewayd: 1\ncell: c\nrobot: {host: r}\n"


def read(text: str) -> Document:
    return read_document(parse(text.encode(), "cell.yaml"))[0]


def test_parts_know_their_places() -> None:
    """Rules point at keys and values; what is not there gives way to what is around it."""
    document = read(HEAD + "variables:\n  a: {robot: x, limits: [0, 10]}\n")
    part = document.variables["a"]
    assert (part.key.line, part.key.column) == (5, 3)
    assert part.at("limits", 1).column == 29
    assert part.key_at("limits").column == 17
    assert part.at("group") == part.node.position
    assert document.at("variables", "a", "robot").column == 14
    assert document.key_at("robot").line == 3


def test_a_section_is_found_by_its_type() -> None:
    document = read(HEAD + "variables: {}")
    robot = document.part(RobotSection)
    assert robot is not None
    assert robot.spec.host == "r"
    assert document.part(Modbus) is None
