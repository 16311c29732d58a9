from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from gatewayd.links.modbus_server.traffic import ModbusTraffic
from gatewayd.modbus.frames import encode


def test_an_answer_is_told_by_its_request() -> None:
    traffic = ModbusTraffic()
    ask, answer = encode(7, 1, bytes.fromhex("03 0064 0002")), encode(7, 1, bytes.fromhex("03 04 0001 0002"))
    assert traffic.words(ask, "192.0.2.7:4000", outgoing=False) == "unit 1: read holding 100-101"
    assert traffic.words(answer, "192.0.2.8:4000", outgoing=True).startswith("unit 1: function 3"), (
        "another peer's"
    )
    assert traffic.words(answer, "192.0.2.7:4000", outgoing=True) == "unit 1: holding 100-101 = 1 2"


def test_what_is_remembered_is_bounded() -> None:
    traffic = ModbusTraffic()
    for number in range(5000):
        traffic.words(encode(number, 1, b"\3\0\0\0\1"), "192.0.2.7:4000", outgoing=False)
    assert len(traffic._requests) == 1024


@given(st.binary(max_size=300), st.booleans())
def test_any_bytes_have_words(data: bytes, outgoing: bool) -> None:
    assert ModbusTraffic().words(data, "", outgoing=outgoing)
