from __future__ import annotations

import pytest

from gatewayd.rtde import messages, payloads
from gatewayd.rtde.messages import PackageType


def test_every_package_type_is_decoded_in_both_directions_and_versions() -> None:
    tables: list[object] = [
        set(payloads.FROM_CONTROLLER),
        set(payloads.FROM_CONTROLLER_V1),
        set(payloads.FROM_EXECUTABLE),
        set(payloads.FROM_EXECUTABLE_V1),
    ]
    assert tables == [set(PackageType)] * 4


@pytest.mark.parametrize(
    "kind, payload, words",
    [
        (PackageType.REQUEST_PROTOCOL_VERSION, "", "no bytes, 1 expected"),
        (PackageType.REQUEST_PROTOCOL_VERSION, "0102", "2 bytes, 1 expected"),
        (PackageType.GET_URCONTROL_VERSION, "000000050000", "6 bytes, 16 expected"),
        (PackageType.TEXT_MESSAGE, "0000", "source length 0 does not fit"),
        (PackageType.TEXT_MESSAGE, "", "no payload"),
        (PackageType.TEXT_MESSAGE, "036162", "reaches beyond"),
        (PackageType.TEXT_MESSAGE, "01610262", "source length 2 does not fit"),
        (PackageType.TEXT_MESSAGE, "0161016202ff", "1 byte after the level"),
        (PackageType.DATA_PACKAGE, "", "at least 1"),
        (PackageType.SETUP_OUTPUTS, "", "no recipe id"),
        (PackageType.SETUP_INPUTS, "", "no recipe id"),
        (PackageType.START, "", "no bytes, 1 expected"),
        (PackageType.PAUSE, "0101", "2 bytes, 1 expected"),
    ],
)
def test_what_a_controller_cannot_send_is_refused(kind: PackageType, payload: str, words: str) -> None:
    with pytest.raises(payloads.MalformedPayloadError, match=words):
        payloads.FROM_CONTROLLER[kind](bytes.fromhex(payload))


@pytest.mark.parametrize(
    "kind, payload",
    [
        (PackageType.REQUEST_PROTOCOL_VERSION, "02"),
        (PackageType.GET_URCONTROL_VERSION, "00"),
        (PackageType.TEXT_MESSAGE, "ff"),
        (PackageType.DATA_PACKAGE, ""),
        (PackageType.SETUP_OUTPUTS, "405f400000"),
        (PackageType.START, "01"),
        (PackageType.PAUSE, "01"),
    ],
)
def test_what_a_client_cannot_send_is_refused(kind: PackageType, payload: str) -> None:
    with pytest.raises(payloads.MalformedPayloadError):
        payloads.FROM_EXECUTABLE[kind](bytes.fromhex(payload))


def test_only_one_trailing_comma_is_ignored() -> None:
    decode = payloads.FROM_EXECUTABLE[PackageType.SETUP_INPUTS]
    assert decode(b"a,b,") == messages.SetupInputs(("a", "b"))
    assert decode(b"a,,b,,") == messages.SetupInputs(("a", "", "b", ""))
    assert decode(b"") == messages.SetupInputs(())


def test_nothing_that_a_controller_says_is_lost() -> None:
    """Bytes that are no text are shown as such; two answers that differ never read the same for it."""
    decode = payloads.FROM_CONTROLLER[PackageType.TEXT_MESSAGE]
    assert decode(b"\x03\xff\xfe!\x01\xe4\x02") == messages.TextMessage("\\xff\\xfe!", "\\xe4", 2)
    assert decode(b"\x04\xe2\x82\xac\x1b\x00\x02") == messages.TextMessage("\u20ac\x1b", "", 2)
    names = payloads.FROM_EXECUTABLE[PackageType.SETUP_INPUTS](b"caf\xc3\xa9")
    assert names == messages.SetupInputs(("caf\u00e9",))
    assert payloads.encode_executable(names, 2)[1] == b"caf\xc3\xa9"
    types = payloads.FROM_CONTROLLER[PackageType.SETUP_INPUTS](b"\x00IN\xffT,\x1b[2J")
    assert types == messages.InputsSetup(0, ("IN\\xffT", "\x1b[2J"))


def test_texts_are_cut_to_their_length_byte() -> None:
    long = messages.TextMessage("m" * 300, "s" * 300, 3)
    for encode in (payloads.encode_controller, payloads.encode_executable):
        kind, payload = encode(long, 2)
        assert payloads.FROM_CONTROLLER[kind](payload) == messages.TextMessage("m" * 255, "s" * 255, 3)


@pytest.mark.parametrize(
    "message", [messages.DataPackage(None, b""), messages.SetupOutputs(("a",), None)], ids=["data", "outputs"]
)
def test_a_client_cannot_leave_out_what_version_2_wants(message: messages.ExecutableMessage) -> None:
    with pytest.raises(ValueError, match=r"recipe id|frequency"):
        payloads.encode_executable(message, 2)


@pytest.mark.parametrize("message", [messages.DataPackage(None, b""), messages.OutputsSetup(None, ("BOOL",))])
def test_a_controller_cannot_leave_out_recipe_ids_in_version_2(message: messages.ControllerMessage) -> None:
    with pytest.raises(ValueError, match="recipe id"):
        payloads.encode_controller(message, 2)


def test_properties_are_asked_for_and_told_alike_in_both_versions() -> None:
    asked = messages.ReadProperties(("v1.software.version", "v1.control_box.type"))
    told = messages.PropertiesReply(("UINT64", "UINT32"), bytes(range(12)))
    for version, (controller, executable) in enumerate(
        [
            (payloads.FROM_CONTROLLER_V1, payloads.FROM_EXECUTABLE_V1),
            (payloads.FROM_CONTROLLER, payloads.FROM_EXECUTABLE),
        ],
        1,
    ):
        kind, payload = payloads.encode_executable(asked, version)
        assert payload == b"v1.software.version,v1.control_box.type"
        assert executable[kind](payload) == asked
        kind, payload = payloads.encode_controller(told, version)
        assert payload == b"\0\x0dUINT64,UINT32" + bytes(range(12))
        assert controller[kind](payload) == told


@pytest.mark.parametrize(
    "payload, words", [(b"", "no bytes, at least 2"), (b"\0\x05BOOL", "types of 5 bytes reach beyond")]
)
def test_properties_that_cannot_be_read_are_refused(payload: bytes, words: str) -> None:
    with pytest.raises(payloads.MalformedPayloadError, match=words):
        payloads.FROM_CONTROLLER[PackageType.READ_PROPERTIES](payload)
