from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.rtde import messages
from gatewayd.rtde.codec import MAX_PACKAGE, ClientProtocol, ControllerProtocol, ProtocolError
from gatewayd.rtde.strange import Oddity

bytes_of_ids = st.integers(0, 255)
names = st.lists(st.text("abcdefghijklmnopqrstuvwxyz_0123456789", min_size=1, max_size=20), max_size=40).map(
    tuple
)
words = st.lists(st.sampled_from(["DOUBLE", "BOOL", "IN_USE", "NOT_FOUND"]), max_size=40).map(tuple)
short_text = st.text(max_size=60)
payload = st.binary(max_size=400)

EXECUTABLE_MESSAGES: dict[int, st.SearchStrategy[Any]] = {
    version: st.one_of(
        st.builds(messages.RequestProtocolVersion, st.integers(0, 65535)),
        st.just(messages.GetControllerVersion()),
        st.builds(messages.TextMessage, short_text, short_text, bytes_of_ids),
        st.builds(messages.DataPackage, bytes_of_ids, payload),
        st.builds(messages.SetupOutputs, names, frequency),
        st.builds(messages.SetupInputs, names),
        st.just(messages.Start()),
        st.just(messages.Pause()),
    )
    for version, frequency in ((1, st.none()), (2, st.floats(allow_nan=False)))
}
COMMON = st.one_of(
    st.builds(messages.ControllerVersion, *[st.integers(0, 2**32 - 1)] * 4),
    st.builds(messages.InputsSetup, bytes_of_ids, words),
    st.builds(messages.StartReply, st.booleans()),
    st.builds(messages.PauseReply, st.booleans()),
)
CONTROLLER_MESSAGES: dict[int, st.SearchStrategy[Any]] = {
    1: st.one_of(
        COMMON,
        st.builds(messages.TextMessage, short_text, st.just(""), bytes_of_ids),
        st.builds(messages.DataPackage, st.none(), payload),
        st.builds(messages.OutputsSetup, st.none(), words),
    ),
    2: st.one_of(
        COMMON,
        st.builds(messages.TextMessage, short_text, short_text, bytes_of_ids),
        st.builds(messages.DataPackage, bytes_of_ids, payload),
        st.builds(messages.OutputsSetup, bytes_of_ids, words),
    ),
}


def speaking(version: int) -> tuple[ClientProtocol, ControllerProtocol]:
    """Both ends of a connection on which `version` has been agreed."""
    client, controller = ClientProtocol(), ControllerProtocol()
    if version != 1:
        for _ in controller.receive(client.send(messages.RequestProtocolVersion(version))):
            assert list(client.receive(controller.send(messages.ProtocolVersionReply(True))))
    assert (client.version, controller.version) == (version, version)
    return client, controller


def pieces(data: bytes, cuts: Sequence[int]) -> list[bytes]:
    places = [0, *sorted(cut % (len(data) + 1) for cut in cuts), len(data)]
    return [data[a:b] for a, b in pairwise(places)]


def receive_all(receive: Callable[[bytes], Any], segments: Sequence[bytes]) -> list[Any]:
    return [message for segment in segments for message in receive(segment)]


@pytest.mark.parametrize("version", [1, 2])
@given(data=st.data(), cuts=st.lists(st.integers(0, 10_000), max_size=12))
def test_a_controller_hears_what_a_client_says_however_it_is_cut(
    version: int, data: st.DataObject, cuts: list[int]
) -> None:
    said = data.draw(st.lists(EXECUTABLE_MESSAGES[version], max_size=8))
    client, controller = speaking(version)
    stream = b"".join(client.send(message) for message in said)
    assert receive_all(controller.receive, pieces(stream, cuts)) == said
    assert controller.buffered == 0


@pytest.mark.parametrize("version", [1, 2])
@given(data=st.data(), cuts=st.lists(st.integers(0, 10_000), max_size=12))
def test_a_client_hears_what_a_controller_says_however_it_is_cut(
    version: int, data: st.DataObject, cuts: list[int]
) -> None:
    said = data.draw(st.lists(CONTROLLER_MESSAGES[version], max_size=8))
    client, controller = speaking(version)
    stream = b"".join(controller.send(message) for message in said)
    assert receive_all(client.receive, pieces(stream, cuts)) == said
    assert client.buffered == 0


def test_single_bytes_are_enough() -> None:
    client, controller = speaking(2)
    said: list[messages.ControllerMessage] = [
        messages.OutputsSetup(1, ("DOUBLE",)),
        messages.DataPackage(1, b"12345678"),
    ]
    stream = b"".join(controller.send(message) for message in said)
    assert receive_all(client.receive, [bytes((byte,)) for byte in stream]) == said


CLIENT_BYTES = [
    (1, messages.RequestProtocolVersion(2), "0005 56 0002"),
    (1, messages.GetControllerVersion(), "0003 76"),
    (1, messages.TextMessage("hi", "me", 3), "000a 4d 02 6869 02 6d65 03"),
    (2, messages.TextMessage("hi", "me", 3), "000a 4d 02 6869 02 6d65 03"),
    (1, messages.SetupOutputs(("a", "b")), "0006 4f 612c62"),
    (2, messages.SetupOutputs(("a", "b"), 125.0), "000e 4f 405f400000000000 612c62"),
    (2, messages.SetupInputs(("a", "b")), "0006 49 612c62"),
    (1, messages.DataPackage(7, b"\x01"), "0005 55 07 01"),
    (2, messages.DataPackage(7, b"\x01"), "0005 55 07 01"),
    (2, messages.Start(), "0003 53"),
    (2, messages.Pause(), "0003 50"),
]
CONTROLLER_BYTES = [
    (1, messages.ProtocolVersionReply(True), "0004 56 01"),
    (2, messages.ControllerVersion(5, 12, 0, 1101), "0013 76 00000005 0000000c 00000000 0000044d"),
    (1, messages.TextMessage("legacy", "", 3), "000a 4d 03 6c6567616379"),
    (2, messages.TextMessage("hi", "me", 2), "000a 4d 02 6869 02 6d65 02"),
    (1, messages.OutputsSetup(None, ("BOOL",)), "0007 4f 424f4f4c"),
    (2, messages.OutputsSetup(1, ("BOOL",)), "0008 4f 01 424f4f4c"),
    (1, messages.InputsSetup(1, ("BOOL",)), "0008 49 01 424f4f4c"),
    (2, messages.InputsSetup(0, ("IN_USE",)), "000a 49 00 494e5f555345"),
    (1, messages.DataPackage(None, b"\x01"), "0004 55 01"),
    (2, messages.DataPackage(1, b"\x01"), "0005 55 01 01"),
    (2, messages.StartReply(False), "0004 53 00"),
    (2, messages.PauseReply(True), "0004 50 01"),
]


@pytest.mark.parametrize("version, message, data", CLIENT_BYTES)
def test_what_a_client_sends_byte_by_byte(
    version: int, message: messages.ExecutableMessage, data: str
) -> None:
    client, controller = speaking(version)
    assert client.send(message) == bytes.fromhex(data)
    assert list(controller.receive(bytes.fromhex(data))) == [message]


@pytest.mark.parametrize("version, message, data", CONTROLLER_BYTES)
def test_what_a_controller_sends_byte_by_byte(
    version: int, message: messages.ControllerMessage, data: str
) -> None:
    client, controller = speaking(version)
    assert controller.send(message) == bytes.fromhex(data)
    assert list(client.receive(bytes.fromhex(data))) == [message]


def test_the_trailing_comma_of_ur_rtde_is_ignored() -> None:
    _, controller = speaking(2)
    assert list(controller.receive(bytes.fromhex("0007 49 612c622c"))) == [messages.SetupInputs(("a", "b"))]


def test_a_version_accepted_amid_a_segment_governs_the_rest_of_it() -> None:
    """The client sends both requests at once; the controller answers both at once."""
    client, controller = ClientProtocol(), ControllerProtocol()
    requests = client.send(messages.RequestProtocolVersion(2)) + bytes.fromhex("000c 4f 4059000000000000 61")
    answers = b""
    heard = []
    for message in controller.receive(requests):
        heard.append(message)
        if isinstance(message, messages.RequestProtocolVersion):
            answers += controller.send(messages.ProtocolVersionReply(True))
        else:
            answers += controller.send(messages.OutputsSetup(1, ("DOUBLE",)))
    assert heard[1] == messages.SetupOutputs(("a",), 100.0)
    assert list(client.receive(answers))[1] == messages.OutputsSetup(1, ("DOUBLE",))


def test_a_refused_version_changes_nothing() -> None:
    client, controller = ClientProtocol(), ControllerProtocol()
    assert list(controller.receive(client.send(messages.RequestProtocolVersion(2))))
    assert list(client.receive(controller.send(messages.ProtocolVersionReply(False))))
    assert (client.version, controller.version) == (1, 1)


def test_an_acceptance_nobody_asked_for_changes_nothing() -> None:
    client = ClientProtocol()
    assert list(client.receive(bytes.fromhex("0004 56 01"))) == [messages.ProtocolVersionReply(True)]
    assert client.version == 1


def test_a_text_before_the_version_is_agreed_has_the_layout_of_version_1() -> None:
    client = ClientProtocol()
    client.send(messages.RequestProtocolVersion(2))
    data = (
        bytes.fromhex("0006 4d 02 6869")
        + bytes.fromhex("0004 56 01")
        + bytes.fromhex("0008 4d 02 6869 00 01")
    )
    assert list(client.receive(data)) == [
        messages.TextMessage("hi", "", 2),
        messages.ProtocolVersionReply(True),
        messages.TextMessage("hi", "", 1),
    ]


def test_packages_may_have_65535_bytes_and_not_one_more() -> None:
    client, controller = speaking(2)
    largest = messages.DataPackage(1, bytes(MAX_PACKAGE - 4))
    assert list(client.receive(controller.send(largest))) == [largest]
    with pytest.raises(ValueError, match="larger than a package can be"):
        controller.send(messages.DataPackage(1, bytes(MAX_PACKAGE - 3)))


@pytest.mark.parametrize("size", [0, 1, 2])
def test_a_size_less_than_the_header_is_refused(size: int) -> None:
    """A zero header makes UR's own Python client loop for ever."""
    client, _ = speaking(2)
    with pytest.raises(ProtocolError, match=f"package size {size} is less"):
        list(client.receive(bytes((0, size, 85)) * 4))


GOOD = messages.StartReply(True)
ODD = [
    ("0003 63", Oddity.UNKNOWN_TYPE, 99, "unknown package type 99", ()),
    ("0009 00 010203040506", Oddity.UNKNOWN_TYPE, 0, "unknown package type 0", ()),
    ("0005 53 0101", Oddity.LAYOUT, 83, "START with payload of 2 bytes, 1 expected", (GOOD,)),
    ("0003 53", Oddity.LAYOUT, 83, "START with payload of no bytes, 1 expected", ()),
    (
        "0014 76 00000005 0000000c 00000000 0000044d 00",
        Oddity.LAYOUT,
        118,
        "GET_URCONTROL_VERSION with payload of 17 bytes, 16 expected",
        (messages.ControllerVersion(5, 12, 0, 1101),),
    ),
    (
        "000a 4d 03 6c6567616379",
        Oddity.LAYOUT,
        77,
        "TEXT_MESSAGE with source length 97 does not fit the package",
        (messages.TextMessage("legacy", "", 3),),
    ),
    (
        "0009 4d 01 61 01 62 02 ff",
        Oddity.LAYOUT,
        77,
        "TEXT_MESSAGE with 1 byte after the level",
        (messages.TextMessage("a", "b", 2),),
    ),
    ("0007 4d ff 61 61 61", Oddity.LAYOUT, 77, "TEXT_MESSAGE with message length 255 reaches", ()),
    ("0003 49", Oddity.LAYOUT, 73, "SETUP_INPUTS with no recipe id", (messages.InputsSetup(0, ()),)),
    ("0003 55", Oddity.LAYOUT, 85, "DATA_PACKAGE with payload of no bytes, at least 1 expected", ()),
]


@pytest.mark.parametrize("data, oddity, kind, words, read_as", ODD, ids=[one[0] for one in ODD])
def test_an_odd_package_is_passed_over_or_read_and_the_next_one_is_a_package(
    data: str, oddity: Oddity, kind: int, words: str, read_as: Sequence[messages.ControllerMessage]
) -> None:
    client, controller = speaking(2)
    good, odd = controller.send(GOOD), bytes.fromhex(data)
    for cuts in ((), (len(good) + 2,), (len(good) + 3, len(good) + len(odd))):
        before, strange, *heard, after = receive_all(client.receive, pieces(good + odd + good, cuts))
        assert (before, after) == (GOOD, GOOD)
        assert (strange.oddity, strange.type, strange.data) == (oddity, kind, odd[:16])
        assert strange.reason.startswith(words)
        assert heard == list(read_as)
    assert client.buffered == 0


def test_what_is_kept_of_an_unfinished_package_can_be_shown() -> None:
    client, _ = speaking(2)
    assert not list(client.receive(b"SS"))
    assert client.unfinished == ""
    assert not list(client.receive(b"H-2.0"))
    assert client.unfinished == "7 of 21331 bytes of unknown type 72: 53 53 48 2d 32 2e 30"
    other, _ = speaking(2)
    assert not list(other.receive(bytes.fromhex("0008 55 01")))
    assert other.unfinished == "4 of 8 bytes of DATA_PACKAGE: 00 08 55 01"


def test_messages_before_an_error_are_delivered_and_the_error_names_reason_place_and_bytes() -> None:
    client, controller = ClientProtocol(), ControllerProtocol()
    heard: list[object] = []
    good = controller.send(GOOD)
    list(client.receive(good))
    with pytest.raises(ProtocolError) as caught:
        heard.extend(client.receive(good + bytes.fromhex("0002 53 0101") + good))
    assert heard == [GOOD]
    assert caught.value.offset == 2 * len(good)
    assert caught.value.data == bytes.fromhex("0002 53")
    assert str(caught.value) == (
        "package size 2 is less than its own header of 3 bytes, at byte 8 of the stream: 00 02 53"
    )


def test_after_an_error_nothing_is_taken_in() -> None:
    client = ClientProtocol()
    with pytest.raises(ProtocolError):
        list(client.receive(bytes(3)))
    with pytest.raises(ProtocolError, match="package size 0"):
        client.receive(bytes.fromhex("0004 53 01"))
    assert client.buffered == 0


def test_no_more_than_one_package_is_kept() -> None:
    client, _ = speaking(2)
    assert not list(client.receive(bytes.fromhex("ffff 55") + bytes(MAX_PACKAGE - 4)))
    assert client.buffered == MAX_PACKAGE - 1
    assert len(list(client.receive(b"\x00"))) == 1
    assert client.buffered == 0


def test_the_beginning_of_a_data_package_can_be_known_before_it_comes() -> None:
    client, controller = speaking(2)
    package = controller.send(messages.DataPackage(7, b"values"))
    assert client.data_header(7, 6) + b"values" == package
    client.skip(len(package))
    with pytest.raises(ProtocolError) as caught:
        list(client.receive(package + bytes(3)))
    assert caught.value.offset == 4 + 2 * len(package), (
        "after the version, one that was skipped, one that was read"
    )
