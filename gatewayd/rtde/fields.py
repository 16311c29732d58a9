"""The field catalogue: what is known of each RTDE field before a controller is asked.

From both RTDE guides, and what implementations know beyond them. The controller's own answer to a setup request stays
the truth; the catalogue serves checks, tables, the simulator and hints.

Where the guides are silent about a version the field counts as there from the start; a field that only the newer
guide lists (it covers e-Series and PolyScope X) counts as missing on CB3 unless a source says otherwise.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

from gatewayd.rtde.types import DataType

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

BITS_PER_WORD = 32
"""Bits of `input_bit_registers0_to_31` and its like."""


class Series(Enum):
    """A generation of controllers: its name in mapping files, control rate in Hz and major software version."""

    CB3 = ("cb3", 125, 3)
    E = ("e", 500, 5)
    X = ("x", 500, 10)

    def __init__(self, word: str, base_rate: int, major: int) -> None:
        self.word = word
        """Name in mapping files and on the command line."""
        self.base_rate = base_rate
        """Control cycles per second; output packages come at most this often."""
        self.major = major
        """Major software version."""

    @classmethod
    def from_word(cls, word: str) -> Series:
        """The series named `word` (cb3, e, x); KeyError for another."""
        return {member.word: member for member in cls}[word]

    @classmethod
    def from_major(cls, major: int) -> Series | None:
        """The series with this major software version."""
        return next((member for member in cls if member.major == major), None)


class SoftwareVersion(NamedTuple):
    """A controller software version, comparable within its series."""

    major: int
    minor: int
    bugfix: int = 0

    def __str__(self) -> str:
        return f"{self.major}.{self.minor}.{self.bugfix}"

    @classmethod
    def parse(cls, text: str) -> SoftwareVersion:
        """Read "5.12", "5.12.0" or "5.12.0.1101" (the build is dropped); ValueError for anything else."""
        match = _VERSION.fullmatch(text.strip())
        if match is None:
            msg = f"{text!r} is not a software version like 5.12 or 5.12.0"
            raise ValueError(msg)
        return cls(int(match[1]), int(match[2]), int(match[3] or 0))


_VERSION = re.compile(r"([0-9]+)\.([0-9]+)(?:\.([0-9]+))?(?:\.[0-9]+)?")
_NEVER = SoftwareVersion(1 << 30, 0)


class Since(NamedTuple):
    """First version with a field in each series, by its word; None: from the start."""

    cb3: SoftwareVersion | None = None
    e: SoftwareVersion | None = None
    x: SoftwareVersion | None = None


_START = Since()


@dataclass(frozen=True, slots=True)
class Field:
    """One RTDE field in one direction."""

    name: str
    type: DataType
    comment: str
    unit: str = ""
    """As far as the guides state it; empty otherwise."""
    since: Since = _START

    def first_version(self, series: Series) -> SoftwareVersion | None:
        """First software version of the series with the field; None: from the start. See `exists`."""
        version: SoftwareVersion | None = getattr(self.since, series.word)
        return version

    def exists(self, series: Series) -> bool:
        """Whether any known version of the series has the field."""
        return self.first_version(series) != _NEVER

    def available(self, series: Series, version: SoftwareVersion | None = None) -> bool:
        """Whether that controller should have the field; without a version: whether any of the series has it."""
        first = self.first_version(series)
        return first is None or (first != _NEVER and (version is None or version >= first))


@dataclass(frozen=True, slots=True)
class RegisterFamily:
    """General purpose registers with a number in their name."""

    prefix: str
    type: DataType
    numbers: range
    fieldbus: range
    """The numbers that the guides reserve for fieldbus and PLC use."""

    def names(self) -> Iterator[str]:
        """The field names, by number."""
        return (f"{self.prefix}{number}" for number in self.numbers)


REGISTERS: tuple[RegisterFamily, ...] = tuple(
    RegisterFamily(f"{side}_{kind}_register_", data_type, numbers, fieldbus)
    for side in ("input", "output")
    for kind, data_type, numbers, fieldbus in (
        ("bit", DataType.BOOL, range(64, 128), range(0)),
        ("int", DataType.INT32, range(48), range(24)),
        ("double", DataType.DOUBLE, range(48), range(24)),
    )
)
"""Every numbered register family; bits 0 to 63 are the words `*_bit_registers0_to_31` and `32_to_63` instead."""


def _since(cb3: str = "", e: str = "", x: str = "") -> Since:
    """Versions as text; empty: from the start, "-": never."""
    return Since(*(_version(text) for text in (cb3, e, x)))


def _version(text: str) -> SoftwareVersion | None:
    if text == "-":
        return _NEVER
    return SoftwareVersion.parse(text) if text else None


_NOT_CB3 = _since("-")
_LOWER = _since("3.4.0")
_UPPER = _since("3.9.0", "5.3.0")
_TORQUE = _since("-", "5.23.0", "10.11.0")
_GRAVITY = _since("-", "5.26.0", "10.12.0")
_STEP = _since("-", "5.26.0", "10.13.0")
_NOWHERE = _since("-", "-", "-")

_BOOL, _UINT8, _UINT32, _UINT64 = DataType.BOOL, DataType.UINT8, DataType.UINT32, DataType.UINT64
_INT32, _DOUBLE = DataType.INT32, DataType.DOUBLE
_V3, _V6, _V6INT = DataType.VECTOR3D, DataType.VECTOR6D, DataType.VECTOR6INT32

_POSE = "x, y, z and rotation vector rx, ry, rz"
_ANALOG = "mA or V"
_RESERVED = "reserved for fieldbus and PLC use"
_FREE = "for RTDE clients and URCaps"
_TOOL_MODES = "0 disabled, 1 sinking, 2 sourcing, 3 push/pull"


def _words(side: str, note: str = "") -> tuple[Field, ...]:
    comment = f"general purpose {side} bits{note}, {_RESERVED}"
    names = (f"{side}_bit_registers{bits}" for bits in ("0_to_31", "32_to_63"))
    return tuple(Field(name, _UINT32, comment, since=_LOWER) for name in names)


def _registers(side: str, note: str = "") -> Iterator[Field]:
    for family in REGISTERS:
        if family.prefix.startswith(side):
            kind = {_BOOL: "bit", _INT32: "integer", _DOUBLE: "double"}[family.type]
            for number, name in zip(family.numbers, family.names(), strict=True):
                lower = number in family.fieldbus
                comment = f"general purpose {side} {kind}{note}, {_RESERVED if lower else _FREE}"
                yield Field(name, family.type, comment, since=_LOWER if lower else _UPPER)


def _table(*rows: Field) -> Mapping[str, Field]:
    return MappingProxyType({field.name: field for field in rows})


# fmt: off
INPUTS: Mapping[str, Field] = _table(
    Field("speed_slider_mask", _UINT32, "1: take the speed slider from speed_slider_fraction, 0: leave it"),
    Field("speed_slider_fraction", _DOUBLE, "new speed slider value, 0 to 1"),
    Field("standard_digital_output_mask", _UINT8, "which standard digital outputs to set"),
    Field("standard_digital_output", _UINT8, "standard digital outputs"),
    Field("configurable_digital_output_mask", _UINT8, "which configurable digital outputs to set"),
    Field("configurable_digital_output", _UINT8, "configurable digital outputs"),
    Field("tool_digital_output_mask", _UINT8, "which tool digital outputs to set (in no guide)"),
    Field("tool_digital_output", _UINT8, "tool digital outputs (in no guide)"),
    Field("standard_analog_output_mask", _UINT8, "which analog outputs to set: bit 0 output 0, bit 1 output 1"),
    Field("standard_analog_output_type", _UINT8, "domain of analog output 0 (bit 0) and 1: 0 current, 1 voltage"),
    Field("standard_analog_output_0", _DOUBLE, "analog output 0 as a ratio, 0 to 1"),
    Field("standard_analog_output_1", _DOUBLE, "analog output 1 as a ratio, 0 to 1"),
    *_words("input"),
    *_registers("input"),
    Field("external_force_torque", _V6, "external wrench, taken after ft_rtde_input_enable() in the robot program",
          since=_since("3.3")),
)
"""What a client may write, by name."""

OUTPUTS: Mapping[str, Field] = _table(
    Field("timestamp", _DOUBLE, "time since the controller was started", "s"),
    Field("target_q", _V6, "target joint positions"),
    Field("target_qd", _V6, "target joint velocities"),
    Field("target_qdd", _V6, "target joint accelerations"),
    Field("target_current", _V6, "target joint currents"),
    Field("target_moment", _V6, "target joint torques"),
    Field("actual_q", _V6, "joint positions"),
    Field("actual_qd", _V6, "joint velocities"),
    Field("actual_qdd", _V6, "joint accelerations (in no guide, asked for by ur_rtde)", since=_NOWHERE),
    Field("actual_current", _V6, "joint currents"),
    Field("actual_moment", _V6, "joint torques (in no guide, asked for by ur_rtde)", since=_NOWHERE),
    Field("actual_current_window", _V6, "allowed deviation of joint currents from their targets", since=_NOT_CB3),
    Field("actual_current_as_torque", _V6, "joint currents converted to torques", since=_TORQUE),
    Field("joint_control_output", _V6, "joint control currents"),
    Field("actual_TCP_pose", _V6, f"pose of the tool: {_POSE}"),
    Field("actual_TCP_speed", _V6, "speed of the tool: linear and angular", "m/s, rad/s"),
    Field("actual_TCP_force", _V6, "forces and torques at the TCP, payload compensated"),
    Field("target_TCP_pose", _V6, f"target pose of the tool: {_POSE}"),
    Field("target_TCP_speed", _V6, "target speed of the tool: linear and angular", "m/s, rad/s"),
    Field("tcp_offset", _V6, f"TCP seen from the output flange: {_POSE}", since=_since("3.12.0", "5.5.1")),
    Field("actual_TCP_acceleration", _V6, "acceleration of the tool: linear and angular", "m/s², rad/s²", _TORQUE),
    Field("target_TCP_acceleration", _V6, "target acceleration of the tool: linear and angular",
          "m/s², rad/s²", _TORQUE),
    Field("actual_digital_input_bits", _UINT64, "digital inputs: 0-7 standard, 8-15 configurable, 16-17 tool"),
    Field("actual_configurable_digital_input_bits", _UINT64, "configurable digital inputs", since=_NOT_CB3),
    Field("joint_temperatures", _V6, "temperature of each joint", "°C"),
    Field("actual_execution_time", _DOUBLE, "execution time of the controller's real-time thread", "ms"),
    Field("target_execution_time", _DOUBLE, "execution time wanted of the real-time thread", "ms", _NOT_CB3),
    Field("robot_mode", _INT32, "mode of the robot, see modes and states"),
    Field("joint_mode", _V6INT, "mode of each joint, see modes and states"),
    Field("safety_mode", _INT32, "see modes and states; safety_status supersedes it"),
    Field("safety_status", _INT32, "see modes and states", since=_since("3.10.0", "5.4.0")),
    Field("actual_tool_accelerometer", _V3, "accelerometer of the tool: x, y, z"),
    Field("speed_scaling", _DOUBLE, "speed scaling of the trajectory limiter"),
    Field("target_speed_fraction", _DOUBLE, "target speed fraction"),
    Field("actual_momentum", _DOUBLE, "norm of the Cartesian linear momentum"),
    Field("actual_main_voltage", _DOUBLE, "safety control board: main voltage"),
    Field("actual_robot_voltage", _DOUBLE, "safety control board: voltage of the 48 V supply"),
    Field("actual_robot_current", _DOUBLE, "safety control board: current of the robot"),
    Field("actual_joint_voltage", _V6, "joint voltages", "V"),
    Field("actual_digital_output_bits", _UINT64, "digital outputs: 0-7 standard, 8-15 configurable, 16-17 tool"),
    Field("actual_configurable_digital_output_bits", _UINT64, "configurable digital outputs", since=_NOT_CB3),
    Field("runtime_state", _UINT32, "state of the robot program, see modes and states"),
    Field("elbow_position", _V3, "position of the elbow in base coordinates", since=_since("3.5.0")),
    Field("elbow_velocity", _V3, "velocity of the elbow in base coordinates", since=_since("3.5.0")),
    Field("robot_status_bits", _UINT32, "bits 0-3, see status bits"),
    Field("safety_status_bits", _UINT32, "bits 0-11, see status bits; bit 11 from 5.25.0 and 10.12.0"),
    Field("analog_io_types", _UINT32,
          "bits 0-3: analog input 0, 1, analog output 0, 1; 0 current in mA, 1 voltage in V"),
    Field("standard_analog_input0", _DOUBLE, "analog input 0", _ANALOG),
    Field("standard_analog_input1", _DOUBLE, "analog input 1", _ANALOG),
    Field("standard_analog_output0", _DOUBLE, "analog output 0", _ANALOG),
    Field("standard_analog_output1", _DOUBLE, "analog output 1", _ANALOG),
    Field("io_current", _DOUBLE, "current drawn by the IO", "mA"),
    *_words("input", " read back"),
    *_registers("input", " read back"),
    *_words("output"),
    *_registers("output"),
    Field("actual_robot_energy_consumed", _DOUBLE, "energy used by the arm since start-up", "Wh", _TORQUE),
    Field("actual_robot_braking_energy_dissipated", _DOUBLE,
          "braking energy of the arm turned to heat in the control box since start-up", "Wh", _TORQUE),
    Field("encoder0_raw", _INT32, "counter of encoder 0", since=_NOT_CB3),
    Field("encoder1_raw", _INT32, "counter of encoder 1", since=_NOT_CB3),
    Field("euromap67_input_bits", _UINT32, "Euromap67 inputs"),
    Field("euromap67_output_bits", _UINT32, "Euromap67 outputs"),
    Field("euromap67_24V_voltage", _DOUBLE, "Euromap67 24 V supply: voltage", "V"),
    Field("euromap67_24V_current", _DOUBLE, "Euromap67 24 V supply: current", "mA"),
    Field("tool_mode", _UINT32, "mode of the tool, see modes and states"),
    Field("tool_analog_input_types", _UINT32, "bits 0-1: tool analog input 0, 1; 0 current in mA, 1 voltage in V"),
    Field("tool_analog_input0", _DOUBLE, "tool analog input 0", _ANALOG),
    Field("tool_analog_input1", _DOUBLE, "tool analog input 1", _ANALOG),
    Field("tool_output_voltage", _INT32, "output voltage of the tool", "V"),
    Field("tool_output_current", _DOUBLE, "current of the tool", "mA"),
    Field("tool_temperature", _DOUBLE, "temperature of the tool", "°C"),
    Field("tool_output_mode", _UINT8, "mode of the tool's digital outputs: 0 output, 1 power"),
    Field("tool_digital_output0_mode", _UINT8, f"mode of tool output 0: {_TOOL_MODES}"),
    Field("tool_digital_output1_mode", _UINT8, f"mode of tool output 1: {_TOOL_MODES}"),
    Field("tcp_force_scalar", _DOUBLE, "force at the TCP", "N"),
    Field("joint_position_deviation_ratio", _DOUBLE, "at 1 and above protective stop C153 or C159", since=_NOT_CB3),
    Field("collision_detection_ratio", _DOUBLE, "at 1 and above protective stop C157 or C158",
          since=_since("-", "5.15.0")),
    Field("ft_raw_wrench", _V6, "force and torque at the tool flange, not compensated", since=_since("-", "5.9.0")),
    Field("wrench_calc_from_currents", _V6, "forces and torques worked out from joint currents", since=_NOT_CB3),
    Field("payload", _DOUBLE, "payload mass", "kg", _since("3.11.0", "5.5.1")),
    Field("payload_cog", _V3, "centre of gravity of the payload", "m", _since("3.11.0", "5.5.1")),
    Field("payload_inertia", _V6, "inertia of the payload: Ixx, Iyy, Izz, Ixy, Ixz, Iyz",
          "kg·m²", _since("3.15.0", "5.11.0")),
    Field("script_control_line", _UINT32, "script line in control of the robot, 0: none",
          since=_since("", "5.9.0")),
    Field("time_scale_source", _INT32, "why motion is slowed, see modes and states", since=_since("-", "5.17.0")),
    Field("target_gravity", _V3, "gravity set by mounting or set_gravity()", "m/s²", _GRAVITY),
    Field("target_base_acceleration", _V6, "acceleration set by set_base_acceleration()", since=_GRAVITY),
    Field("target_base_wrench", _V6, "target wrench at the base (in no guide)", since=_since("-", "", "10.14.0")),
    Field("control_step", _UINT64, "control steps since start-up (in no guide)", since=_STEP),
)
"""What a client may subscribe, by name; `input_*` fields are read-backs."""
# fmt: on

UNTYPED = frozenset({"dexterity", "tool_output_current_2", "tool_output_voltage_2"})
"""Outputs that the newest controllers are known to have, and whose type no guide states yet."""
