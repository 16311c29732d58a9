from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.rtde import messages
from gatewayd.rtde.codec import ClientProtocol, ControllerProtocol
from gatewayd.rtde.describe import MessageStream, Recipes, package_text


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


def test_data_is_told_by_the_recipes_of_its_connection() -> None:
    client, controller, recipes = ClientProtocol(), ControllerProtocol(), Recipes()
    for endpoint in (client, controller):
        endpoint._speak(2)

    def said(message: messages.ControllerMessage) -> str:
        return package_text(controller.send(message), recipes, from_controller=True)

    data = messages.DataPackage(1, struct.pack(">d3d", 12.5, 1.0, -2.0, 0.25))
    assert said(data) == "data of recipe 1, 32 bytes"
    asked = client.send(messages.SetupOutputs(("timestamp", "actual_tool_accelerometer"), 125.0))
    package_text(asked, recipes, from_controller=False)
    said(messages.OutputsSetup(1, ("DOUBLE", "VECTOR3D")))
    values = "timestamp = 12.5, actual_tool_accelerometer = 1 -2 0.25"
    assert said(data) == f"data of recipe 1, 32 bytes: {values}"
    assert said(messages.DataPackage(1, bytes(8))) == "data of recipe 1, 8 bytes", "another length"
    package_text(client.send(messages.SetupInputs(("input_int_register_0",))), recipes, from_controller=False)
    said(messages.InputsSetup(1, ("INT32",)))
    sent = client.send(messages.DataPackage(1, struct.pack(">i", -7)))
    assert package_text(sent, recipes, from_controller=False).endswith(": input_int_register_0 = -7")
    said(messages.InputsSetup(1, ("IN_USE",)))
    assert package_text(sent, recipes, from_controller=False) == "data of recipe 1, 4 bytes"


@given(st.lists(st.binary(max_size=300), max_size=5), st.booleans())
def test_any_bytes_have_a_description(pieces: list[bytes], from_controller: bool) -> None:
    stream, recipes = MessageStream(), Recipes()
    for piece in pieces:
        for package in stream.feed(piece):
            assert package_text(package, recipes, from_controller=from_controller)
