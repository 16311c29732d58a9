"""What pymodbus's request classes let through, function by function: why none of them serves requests here.

`docs/reference/dependencies.md` has the result. If this file fails after an update, pymodbus has become stricter.
"""

from __future__ import annotations

import logging

import pytest
from pymodbus.pdu import DecodePDU

from gatewayd.core.requester import Requester
from gatewayd.links.modbus_server.functions import Unit, execute
from gatewayd.modbus.exceptions import ExceptionCode
from tests.links.modbus_server.conftest import NOW, PLC

MALFORMED = {
    1: {
        "cut short": "01 0000",
        "byte too many": "01 0000 0001 00",
        "none": "01 0000 0000",
        "2001": "01 0000 07d1",
    },
    2: {
        "cut short": "02 0003",
        "byte too many": "02 0003 0001 00",
        "none": "02 0003 0000",
        "2001": "02 0003 07d1",
    },
    3: {
        "cut short": "03 0000",
        "byte too many": "03 0000 0001 00",
        "none": "03 0000 0000",
        "126": "03 0000 007e",
    },
    4: {
        "cut short": "04 0000",
        "byte too many": "04 0000 0001 00",
        "none": "04 0000 0000",
        "126": "04 0000 007e",
    },
    5: {"cut short": "05 0000 ff", "byte too many": "05 0000 ff00 00", "neither on nor off": "05 0000 0001"},
    6: {"cut short": "06 000a", "byte too many": "06 000a 0005 00"},
    15: {
        "cut short": "0f 0000 000a 02 ff",
        "byte too many": "0f 0000 000a 02 ff03 00",
        "none": "0f 0000 0000 00",
        "1969": "0f 0000 07b1 f7" + "00" * 247,
        "byte count": "0f 0000 000a 01 ff",
    },
    16: {
        "cut short": "10 000a 0001 02 00",
        "byte too many": "10 000a 0001 02 0005 00",
        "none": "10 000a 0000 00",
        "124": "10 000a 007c f8" + "00" * 247,
        "byte count": "10 000a 0001 03 000100",
    },
    22: {"cut short": "16 000a 00f2", "byte too many": "16 000a 00f2 0025 00"},
    23: {
        "cut short": "17 000a 0001 000a 0001 02 00",
        "byte too many": "17 000a 0001 000a 0001 02 0007 00",
        "none": "17 000a 0000 000a 0001 02 0007",
        "126": "17 000a 007e 000a 0001 02 0007",
        "122 written": "17 000a 0001 000a 007a f4" + "00" * 243,
        "byte count": "17 000a 0001 000a 0001 03 000700",
    },
    43: {
        "cut short": "2b 0e 01",
        "byte too many": "2b 0e 01 00 00",
        "code 0": "2b 0e 00 00",
        "code 5": "2b 0e 05 00",
    },
}
"""Function -> what V1.1b3 has answered with exception 03."""

LONGER = "byte too many"
ACCEPTED = {
    1: {LONGER},
    2: {LONGER},
    3: {LONGER},
    4: {LONGER},
    5: {LONGER, "neither on nor off"},
    6: {LONGER},
    15: {LONGER, "cut short", "1969", "byte count"},
    16: {LONGER, "cut short", "none", "124", "byte count"},
    22: {LONGER},
    23: {LONGER, "cut short", "122 written", "byte count"},
    43: {LONGER, "code 0", "code 5"},
}
"""Function -> what of that pymodbus decodes as if it were well-formed."""


@pytest.mark.parametrize("function", MALFORMED)
def test_what_the_specification_forbids(unit: Unit, caplog: pytest.LogCaptureFixture, function: int) -> None:
    caplog.set_level(logging.CRITICAL, "pymodbus")
    requests = {name: bytes.fromhex(pdu) for name, pdu in MALFORMED[function].items()}
    decoder = DecodePDU(is_server=True)
    assert {name for name, pdu in requests.items() if decoder.decode(pdu) is not None} == ACCEPTED[function]
    for pdu in requests.values():
        answer = execute(unit, Requester(PLC), pdu, NOW)
        assert answer == bytes((function | 0x80, ExceptionCode.ILLEGAL_VALUE))
