from __future__ import annotations

from gatewayd.mapping.loader import load
from gatewayd.mapping.remarks import remarks

HEAD = """\
gatewayd: 1
cell: press-3
robot: {host: 127.0.0.10}
modbus: {listen: '127.0.0.1:1502'}
canopen: {channel: can0, bitrate: 500000, node: 16}
writers:
  plc: {modbus: 127.0.0.2, timeout: 1s}
variables:
"""


def test_what_happens_to_reals_is_said_by_line() -> None:
    """Towards the robot NaN where nothing limits it; integers for reals in both directions."""
    text = HEAD + (
        "  a: {robot: 'input_double_register_0..2', modbus: {holding: 0, type: float32}, owner: plc}\n"
        "  b: {robot: input_double_register_5, modbus: 20, canopen: object, owner: plc}\n"
        "  c: {robot: input_double_register_6, modbus: 30, owner: plc, limits: [0, 1]}\n"
        "  d: {robot: output_double_register_0, modbus: {holding: 40, type: int16, scale: 0.1}}\n"
        "  e: {robot: input_double_register_7, modbus: {holding: 50, type: uint16, scale: 0.1}, owner: plc}\n"
        "  f: {robot: output_int_register_0, modbus: 60}\n"
    )
    assert list(remarks(load(text.encode(), "cell.yaml").cell)) == [
        (
            "reals are rounded to integers (halves to even), limited to the range of the type, and NaN becomes 0: "
            "`d` and `e`"
        ),
        "without limits, NaN and infinities reach the robot: `a` and `b`",
    ]


def test_nothing_happens() -> None:
    assert (
        list(remarks(load((HEAD + "  f: {robot: runtime_state, modbus: 60}\n").encode(), "cell.yaml").cell))
        == []
    )


def test_integers_of_a_device_are_no_reals_that_are_rounded() -> None:
    """`level` is the integer of the device times 0.1: nothing of a real is lost. Outputs to it are rounded."""
    devices = "devices: {island: {modbus: 127.0.0.3, watchdog: none}}\n"
    head = HEAD.replace("writers:", f"{devices}writers:\n  island: {{device: island}}")
    text = head + (
        "  level: {robot: input_double_register_0, device: {at: island, input: 4, type: int16, scale: 0.1},"
        " owner: island, limits: [0, 100]}\n"
        "  speed: {robot: output_double_register_0, device: {at: island, holding: 4, type: int16, scale: 0.1}}\n"
    )
    found = load(text.encode(), "cell.yaml")
    assert [each.message for each in found.errors] == []
    (remark,) = remarks(found.cell)
    assert remark.startswith("reals are rounded")
    assert remark.endswith(": `speed`")
