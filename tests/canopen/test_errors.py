"""Error frames as drivers really send them."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from gatewayd.canopen.errors import ControllerFlags, ErrorClass, Violation, decode

ERROR_FLAG = 0x2000_0000


def test_controller_report_with_counters() -> None:
    """slcan's `sw100120`: warning, 100 transmit and 120 receive errors."""
    error = decode(ERROR_FLAG | 0x204, bytes([0, 0x0C, 0, 0, 0, 0, 100, 120]))
    assert error.classes == ErrorClass.CONTROLLER | ErrorClass.COUNTERS
    assert error.controller == ControllerFlags.RX_WARNING | ControllerFlags.TX_WARNING
    assert (error.tx_errors, error.rx_errors) == (100, 120)
    assert str(error) == "controller, rx warning, tx warning, transmit errors: 100, receive errors: 120"


def test_counters_of_old_kernels_are_not_announced() -> None:
    error = decode(ERROR_FLAG | 0x004, bytes([0, 0x20, 0, 0, 0, 0, 130, 0]))
    assert (error.tx_errors, error.rx_errors) == (130, 0)


def test_bus_off_says_nothing_of_counters() -> None:
    error = decode(ERROR_FLAG | 0x040, bytes(8))
    assert error.classes == ErrorClass.BUS_OFF
    assert error.tx_errors is None
    assert str(error) == "bus off"


def test_protocol_violation_in_words() -> None:
    error = decode(ERROR_FLAG | 0x088, bytes([0, 0, 0x84, 0x0A, 0, 0, 0, 0]))
    assert error.violation == Violation.STUFFING | Violation.WHILE_SENDING
    assert str(error) == "protocol, bus error, stuffing, while sending"


@given(st.integers(0, 0x1FFF_FFFF), st.binary(max_size=8))
def test_anything_can_be_decoded_and_worded(can_id: int, data: bytes) -> None:
    assert str(decode(ERROR_FLAG | can_id, data))
