"""Numbers, types and packages as the other clients have them, byte by byte: what they print is written out here."""

from __future__ import annotations

import ast
import struct
from collections.abc import Mapping
from enum import IntEnum
from pathlib import Path
from typing import Any

import pytest

import gatewayd.rtde
from gatewayd import rtde
from gatewayd.rtde import enums, messages
from gatewayd.rtde.codec import ClientProtocol
from gatewayd.rtde.messages import PackageType, TextLevel
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.types import DEFAULT_PORT, DataType

LIBRARY = Path(gatewayd.rtde.__file__).parent


def test_the_port_is_the_one_of_the_controller() -> None:
    assert DEFAULT_PORT == 30004
    assert rtde.connect("robot.local").port == DEFAULT_PORT
    assert rtde.connect("robot.local", port=50001).port == 50001


LETTERS = {
    "V": PackageType.REQUEST_PROTOCOL_VERSION,
    "v": PackageType.GET_URCONTROL_VERSION,
    "M": PackageType.TEXT_MESSAGE,
    "U": PackageType.DATA_PACKAGE,
    "O": PackageType.SETUP_OUTPUTS,
    "I": PackageType.SETUP_INPUTS,
    "S": PackageType.START,
    "P": PackageType.PAUSE,
    "R": PackageType.READ_PROPERTIES,
}


@pytest.mark.parametrize("letter", LETTERS)
def test_a_package_type_has_its_letter(letter: str) -> None:
    assert PackageType(ord(letter)) is LETTERS[letter]


def test_there_are_nine_package_types() -> None:
    assert set(PackageType) == set(LETTERS.values())


REQUESTS: Mapping[str, tuple[messages.ExecutableMessage, str]] = {
    "RequestProtocolVersion": (messages.RequestProtocolVersion(2), "0005 56 0002"),
    "GetControllerVersion": (messages.GetControllerVersion(), "0003 76"),
    "SetupOutputs": (
        messages.SetupOutputs(("timestamp", "payload"), 125.0),
        "001c 4f 405f400000000000" + b"timestamp,payload".hex(),
    ),
    "SetupInputs": (messages.SetupInputs(("speed_slider_mask",)), "0014 49" + b"speed_slider_mask".hex()),
    "Start": (messages.Start(), "0003 53"),
    "Pause": (messages.Pause(), "0003 50"),
    "TextMessage": (
        messages.TextMessage("on", "me", 3),
        "000a 4d 02" + b"on".hex() + "02" + b"me".hex() + "03",
    ),
    "DataPackage": (messages.DataPackage(1, b"\0\0\0\7"), "0008 55 01 00000007"),
    "ReadProperties": (
        messages.ReadProperties(("v1.control_box.type",)),
        "0016 52" + b"v1.control_box.type".hex(),
    ),
}
REPLIES: Mapping[str, tuple[messages.ControllerMessage, str]] = {
    "ProtocolVersionReply": (messages.ProtocolVersionReply(True), "0004 56 01"),
    "ControllerVersion": (
        messages.ControllerVersion(5, 12, 1, 1101),
        "0013 76 00000005 0000000c 00000001 0000044d",
    ),
    "OutputsSetup": (messages.OutputsSetup(1, ("DOUBLE", "INT32")), "0010 4f 01" + b"DOUBLE,INT32".hex()),
    "InputsSetup": (messages.InputsSetup(2, ("IN_USE",)), "000a 49 02" + b"IN_USE".hex()),
    "StartReply": (messages.StartReply(True), "0004 53 01"),
    "PauseReply": (messages.PauseReply(False), "0004 50 00"),
    "TextMessage": (
        messages.TextMessage("on", "me", 1),
        "000a 4d 02" + b"on".hex() + "02" + b"me".hex() + "01",
    ),
    "DataPackage": (messages.DataPackage(1, b"\0\0\0\7"), "0008 55 01 00000007"),
}


def speaking_version_2() -> ClientProtocol:
    protocol = ClientProtocol()
    protocol.send(messages.RequestProtocolVersion(2))
    assert list(protocol.receive(bytes.fromhex("0004 56 01"))) == [messages.ProtocolVersionReply(True)]
    return protocol


@pytest.mark.parametrize("name", REQUESTS)
def test_a_request_has_the_bytes_of_the_guide(name: str) -> None:
    message, package = REQUESTS[name]
    assert type(message).__name__ == name
    assert speaking_version_2().send(message) == bytes.fromhex(package)


@pytest.mark.parametrize("name", REPLIES)
def test_a_reply_is_read(name: str) -> None:
    message, package = REPLIES[name]
    assert type(message).__name__ == name
    assert list(speaking_version_2().receive(bytes.fromhex(package))) == [message]


@pytest.mark.parametrize("size", [1, 2, 3, 7])
def test_a_stream_is_cut_into_packages(size: int) -> None:
    """`ClientProtocol` does what ControlHeader, PackageHeader and RTDEParser do, whatever the pieces."""
    stream = b"".join(bytes.fromhex(package) for _, package in REPLIES.values())
    protocol = speaking_version_2()
    found = [
        message
        for start in range(0, len(stream), size)
        for message in protocol.receive(stream[start : start + size])
    ]
    assert found == [message for message, _ in REPLIES.values()]
    assert protocol.buffered == 0


def test_a_version_1_text_has_its_type_first() -> None:
    assert list(ClientProtocol().receive(bytes.fromhex("0006 4d 02") + b"on")) == [
        messages.TextMessage("on", "", 2)
    ]


def test_a_controller_version_compares_and_has_four_numbers() -> None:
    version = messages.ControllerVersion(5, 12, 1, 1101)
    assert (version.major, version.minor, version.bugfix, version.build) == (5, 12, 1, 1101)
    assert str(version) == "5.12.1.1101"
    assert messages.ControllerVersion(5, 9, 4, 10321) < version < messages.ControllerVersion(10, 0, 0, 0)


TYPES = {
    "BOOL": ("?", 1),
    "UINT8": ("B", 1),
    "UINT32": ("I", 1),
    "UINT64": ("Q", 1),
    "INT32": ("i", 1),
    "DOUBLE": ("d", 1),
    "VECTOR3D": ("d", 3),
    "VECTOR6D": ("d", 6),
    "VECTOR6INT32": ("i", 6),
    "VECTOR6UINT32": ("I", 6),
}


@pytest.mark.parametrize("word", TYPES)
def test_a_data_type_has_its_letter_and_elements(word: str) -> None:
    kind = DataType.from_word(word)
    assert (kind.word, kind.code, kind.count) == (word, *TYPES[word])
    assert Recipe(["x"], [kind]).size == struct.calcsize(f">{TYPES[word][1]}{TYPES[word][0]}")


def test_there_are_ten_data_types() -> None:
    assert [kind.word for kind in DataType] == list(TYPES)
    with pytest.raises(KeyError):
        DataType.from_word("NOT_FOUND")


def test_a_recipe_is_what_the_controller_answered() -> None:
    """As DataConfig: names with types, values to bytes and back; vectors have a slot of their length."""
    recipe = Recipe(
        ["timestamp", "actual_q", "robot_mode"], [DataType.DOUBLE, DataType.VECTOR6D, DataType.INT32]
    )
    values: tuple[Any, ...] = (1.5, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 7)
    assert recipe.pack(values) == struct.pack(">d6di", *values)
    assert recipe.unpack(struct.pack(">d6di", *values)) == values
    assert (recipe.names, recipe.kinds["robot_mode"]) == (
        ("timestamp", "actual_q", "robot_mode"),
        DataType.INT32,
    )
    assert values[recipe.slots["actual_q"]] == (0.0, 1.0, 2.0, 3.0, 4.0, 5.0)


STATES: Mapping[str, tuple[type[IntEnum], Mapping[int, str]]] = {
    "RobotMode": (
        enums.RobotMode,
        {
            -1: "NO_CONTROLLER",
            0: "DISCONNECTED",
            1: "CONFIRM_SAFETY",
            2: "BOOTING",
            3: "POWER_OFF",
            4: "POWER_ON",
            5: "IDLE",
            6: "BACKDRIVE",
            7: "RUNNING",
            8: "UPDATING",
        },
    ),
    "ProgramState": (
        enums.ProgramState,
        dict(enumerate(("STOPPING", "STOPPED", "RUNNING", "PAUSING", "PAUSED", "RESUMING", "RETRACTING"))),
    ),
}
SAFETY = {
    1: "NORMAL",
    2: "REDUCED",
    3: "PROTECTIVE_STOP",
    4: "RECOVERY",
    5: "SAFEGUARD_STOP",
    6: "SYSTEM_EMERGENCY_STOP",
    7: "ROBOT_EMERGENCY_STOP",
    8: "VIOLATION",
    9: "FAULT",
    10: "VALIDATE_JOINT_ID",
    11: "UNDEFINED",
    12: "AUTOMATIC_MODE_SAFEGUARD_STOP",
    13: "SYSTEM_THREE_POSITION_ENABLING_STOP",
    14: "TP_THREE_POSITION_ENABLING_STOP",
    15: "IMMI_EMERGENCY_STOP",
    16: "IMMI_SAFEGUARD_STOP",
    17: "PROFISAFE_WAITING_FOR_PARAMETERS",
    18: "PROFISAFE_AUTOMATIC_MODE_SAFEGUARD_STOP",
    19: "PROFISAFE_SAFEGUARD_STOP",
    20: "PROFISAFE_EMERGENCY_STOP",
    22: "SAFETY_API_SAFEGUARD_STOP",
}


@pytest.mark.parametrize("name", ["RobotMode", "ProgramState", "SafetyMode", "SafetyStatus"])
def test_states_have_the_numbers_of_the_cpp_client(name: str) -> None:
    """Its newest version; it says UPDATING_FIRMWARE, PLAYING for a program that runs, UNDEFINED_SAFETY_MODE."""
    states, numbers = STATES.get(name, (getattr(enums, name), SAFETY))
    assert {number: states(number).name for number in numbers} == numbers


BITS = {
    "robot_status_bits": ("power on", "program running", "teach button pressed", "power button pressed"),
    "safety_status_bits": (
        "normal mode",
        "reduced mode",
        "protective stopped",
        "recovery mode",
        "safeguard stopped",
        "system emergency stopped",
        "robot emergency stopped",
        "emergency stopped",
        "violation",
        "fault",
        "stopped due to safety",
        "3PE input active",
    ),
}


@pytest.mark.parametrize("field", BITS)
def test_status_bits_have_the_places_of_the_cpp_client(field: str) -> None:
    assert [words.on for words in enums.BITS[field].values()] == list(BITS[field])
    assert list(enums.BITS[field]) == list(range(len(BITS[field])))


@pytest.mark.parametrize("field", ["robot_mode", "safety_mode", "safety_status"])
def test_meanings_give_the_name_of_a_value(field: str) -> None:
    states = enums.STATES[field]
    words = enums.meanings(field, None)
    assert {number: words[number].replace(" ", "_").upper() for number in states} == {
        int(state): state.name for state in states
    }


@pytest.mark.parametrize("level, number", [("EXCEPTION", 0), ("ERROR", 1), ("WARNING", 2), ("INFO", 3)])
def test_a_text_level_has_its_number(level: str, number: int) -> None:
    """Also in what arrives: `TextMessage` and `TextEvent` have it as the controller sent it."""
    assert TextLevel[level] == number
    package = bytes.fromhex(f"000a 4d 02 6f6e 02 6d65 0{number}")
    assert list(speaking_version_2().receive(package)) == [messages.TextMessage("on", "me", TextLevel[level])]
    assert str(rtde.TextEvent("on", "me", number)).startswith(level.lower())


ERRORS = (
    "ConnectFailedError",
    "ConnectionLostError",
    "FieldsRefusedError",
    "NotVerifiedError",
    "TypesDifferError",
    "WriteRefusedError",
)


@pytest.mark.parametrize("name", ERRORS)
def test_every_error_is_an_rtde_error(name: str) -> None:
    assert issubclass(getattr(rtde, name), rtde.RtdeError)
    assert set(ERRORS) | {"RtdeError"} == {each for each in rtde.__all__ if each.endswith("Error")}


def test_an_error_is_its_message() -> None:
    """As RTDEException.msg: `str` of an RtdeError, without quotes."""
    assert str(rtde.RtdeError("nothing came")) == "nothing came"
    assert str(rtde.ConnectFailedError("connection refused")) == "connection refused"


def test_nothing_of_the_library_ends_the_process() -> None:
    """No SystemExit: what a caller must expect is an RtdeError, or ValueError and TypeError for wrong arguments."""
    found = [
        f"{path.name}:{node.lineno}"
        for path in LIBRARY.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if (isinstance(node, ast.Name) and node.id in ("SystemExit", "exit", "quit"))
        or (isinstance(node, ast.Attribute) and ast.unparse(node) in ("sys.exit", "os._exit", "os.abort"))
    ]
    assert found == []
    assert issubclass(rtde.RtdeError, Exception)
