"""Structured text: what the bodies say, and that portable conversions need nothing beyond edition 2."""

from __future__ import annotations

import re

import pytest

from gatewayd.links.modbus_server.plc.st.decode import unpack
from gatewayd.links.modbus_server.plc.st.encode import pack
from gatewayd.links.modbus_server.plc.st.exchange import cyclic
from gatewayd.links.modbus_server.plc.targets.iec_st import DIALECT, files
from gatewayd.plc.st.dialect import literal, real
from gatewayd.plc.st.source import comment
from tests.links.modbus_server.plc.cells import model
from tests.plc_golden import golden_model


@pytest.mark.parametrize(
    "order, operands",
    [
        ("ABCD", "high := image.read1[0], low := image.read1[1]"),
        ("CDAB", "high := image.read1[1], low := image.read1[0]"),
        ("BADC", "high := GW_Swap(value := image.read1[0]), low := GW_Swap(value := image.read1[1])"),
        ("DCBA", "high := GW_Swap(value := image.read1[1]), low := GW_Swap(value := image.read1[0])"),
    ],
)
def test_word_orders(order: str, operands: str) -> None:
    found = model(f"a: {{robot: output_int_register_0, modbus: {{holding: 9, type: int32, order: {order}}}}}")
    assert f"double := GW_Double({operands});" in "\n".join(unpack(found, DIALECT).body)


def test_lost_values_are_what_the_mapping_says() -> None:
    """The same that the gateway shows when the robot is lost; what is held stays as it was."""
    found = model(
        "a: {robot: output_bit_register_0, modbus: 1.0, on_stale: true}",
        "b: {robot: output_int_register_0, modbus: 2, on_stale: -1}",
        "c: {robot: output_int_register_1, modbus: 4, on_stale: hold}",
    )
    body = "\n".join(unpack(found, DIALECT).body)
    assert body.partition("ELSE")[2].split() == [
        "outputs.a",
        ":=",
        "TRUE;",
        "outputs.b",
        ":=",
        "-1;",
        "END_IF;",
    ]


def test_only_what_is_used_is_declared() -> None:
    """A small controller has no LWORD."""
    found = model("a: {robot: input_int_register_0, modbus: 2, owner: plc}")
    assert [field.name for field in pack(found, DIALECT).sections[-1].fields] == ["double"]


def test_slow_requests_come_last() -> None:
    order = [(poll.shared, poll.slow) for poll in cyclic(golden_model())]
    assert order == sorted(order, key=lambda kind: (kind[1], kind[0]))


@pytest.mark.parametrize(
    "value, kind, text",
    [
        (0.1, "REAL", "REAL#0.1"),
        (1e-05, "LREAL", "LREAL#1.0E-5"),
        (1.5e300, "LREAL", "LREAL#1.5E300"),
        (-7, "DINT", "-7"),
        (True, "BOOL", "TRUE"),
        (3, "REAL", "REAL#3.0"),
    ],
)
def test_literals(value: float, kind: str, text: str) -> None:
    assert literal(value, kind) == text


def test_a_literal_has_every_digit() -> None:
    assert float(real(1 / 3, "LREAL").partition("#")[2]) == 1 / 3


def test_no_text_ends_a_comment() -> None:
    assert comment("a *) b (* c") == "(* a * ) b ( * c *)"


def test_edition_2_has_no_union_no_parts_of_words_and_no_line_comments() -> None:
    text = "".join(file.text for file in files(golden_model()))
    code = re.sub(r"\(\*.*?\*\)", "", text)
    assert "UNION" not in code
    assert not re.search(r"\]\.\d", code)
    assert "//" not in code
    assert max(map(len, re.findall(r"\w+", code))) <= 32
