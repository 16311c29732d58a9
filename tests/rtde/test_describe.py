from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.rtde import messages
from gatewayd.rtde.codec import ClientProtocol, ControllerProtocol
from gatewayd.rtde.describe import MessageStream, package_text


@pytest.mark.parametrize(
    "message, text",
    [
        (messages.RequestProtocolVersion(2), "request protocol version 2"),
        (messages.GetControllerVersion(), "ask for the controller's version"),
        (
            messages.SetupOutputs(("timestamp", "actual_q"), 125.0),
            "set up outputs at 125 Hz: timestamp, actual_q",
        ),
        (messages.SetupInputs(tuple("abcdefgh")), "set up inputs: a, b, c, d, e, f and 2 more"),
        (messages.Start(), "start"),
        (messages.Pause(), "pause"),
        (messages.DataPackage(3, bytes(8)), "data of recipe 3, 8 bytes"),
    ],
)
def test_what_a_client_says(message: messages.ExecutableMessage, text: str) -> None:
    client = ClientProtocol()
    client._speak(2)
    assert package_text(client.send(message), from_controller=False) == text


@pytest.mark.parametrize(
    "message, text",
    [
        (messages.ProtocolVersionReply(True), "protocol version accepted"),
        (messages.ControllerVersion(5, 13, 1, 7), "controller version 5.13.1.7"),
        (messages.OutputsSetup(1, ("DOUBLE", "VECTOR6D")), "outputs set up, recipe 1: DOUBLE, VECTOR6D"),
        (messages.InputsSetup(0, ("IN_USE",)), "inputs set up, refused: IN_USE"),
        (messages.StartReply(False), "start refused"),
        (messages.PauseReply(True), "pause accepted"),
        (messages.DataPackage(1, bytes(24)), "data of recipe 1, 24 bytes"),
        (messages.TextMessage("joint 3", "RTDE", 2), "text (warning) of RTDE: joint 3"),
    ],
)
def test_what_a_controller_says(message: messages.ControllerMessage, text: str) -> None:
    controller = ControllerProtocol()
    controller._speak(2)
    assert package_text(controller.send(message), from_controller=True) == text


def test_a_stream_is_cut_into_packages_wherever_its_pieces_end() -> None:
    packages = [bytes((0, 4, 85, 1)), bytes((0, 3, 83)), bytes((0, 5, 80, 1, 2))]
    whole = b"".join(packages)
    for cut in range(len(whole)):
        stream = MessageStream()
        assert [*stream.feed(whole[:cut]), *stream.feed(whole[cut:])] == packages


@given(st.lists(st.binary(max_size=300), max_size=5), st.booleans())
def test_any_bytes_have_a_description(pieces: list[bytes], from_controller: bool) -> None:
    stream = MessageStream()
    for piece in pieces:
        for package in stream.feed(piece):
            assert package_text(package, from_controller=from_controller)
