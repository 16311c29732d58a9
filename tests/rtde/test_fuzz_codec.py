"""Hostile bytes to both ends. GATEWAYD_FUZZ_CASES sets how many."""

from __future__ import annotations

import os
import random
import typing

import pytest

from gatewayd.rtde import messages
from gatewayd.rtde.codec import MAX_PACKAGE, ClientProtocol, ControllerProtocol, ProtocolError
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.strange import StrangePackage
from gatewayd.rtde.types import DataType

CASES = int(os.environ.get("GATEWAYD_FUZZ_CASES", "5000"))
RECIPE = Recipe(["timestamp", "actual_q", "robot_mode"], [DataType.DOUBLE, DataType.VECTOR6D, DataType.INT32])
NAMES = tuple(f"input_int_register_{number}" for number in range(24))
FROM_CONTROLLER: tuple[messages.ControllerMessage, ...] = (
    messages.ProtocolVersionReply(True),
    messages.ControllerVersion(5, 12, 0, 1101),
    messages.TextMessage("SafetySetup has not been confirmed yet", "URControl", 2),
    messages.OutputsSetup(1, ("DOUBLE", "VECTOR6D", "INT32")),
    messages.InputsSetup(1, ("INT32",) * 24),
    messages.StartReply(True),
    messages.DataPackage(1, RECIPE.pack([1.0] * 7 + [7])),
    messages.PauseReply(True),
)
FROM_CLIENT: tuple[messages.ExecutableMessage, ...] = (
    messages.RequestProtocolVersion(2),
    messages.GetControllerVersion(),
    messages.TextMessage("hello", "client", 3),
    messages.SetupOutputs(NAMES, 500.0),
    messages.SetupInputs(NAMES),
    messages.Start(),
    messages.DataPackage(1, bytes(96)),
    messages.Pause(),
)
CONTROLLER_TYPES = typing.get_args(messages.ControllerMessage)
CLIENT_TYPES = typing.get_args(messages.ExecutableMessage)


def mutated(rng: random.Random, stream: bytes) -> bytes:
    """Some bytes changed, dropped, doubled or put in."""
    data = bytearray(stream)
    for _ in range(rng.randint(1, 6)):
        place = rng.randrange(len(data) + 1)
        match rng.randrange(5):
            case 0 if place < len(data):
                data[place] = rng.randrange(256)
            case 1:
                del data[place : place + rng.randint(1, 8)]
            case 2:
                data[place:place] = rng.randbytes(rng.randint(1, 8))
            case 3:
                data += data[place : place + 20]
            case _:
                data[place:place] = bytes((0, rng.randrange(12), rng.choice(b"VvMUOISP")))
    return bytes(data)


def segments(rng: random.Random, data: bytes) -> list[bytes]:
    cuts = sorted(rng.randrange(len(data) + 1) for _ in range(rng.randint(0, 5)))
    return [data[a:b] for a, b in zip([0, *cuts], [*cuts, len(data)], strict=True)]


def streams(rng: random.Random, packages: list[bytes]) -> bytes:
    if rng.random() < 0.1:
        return rng.randbytes(rng.randint(0, 300))
    return mutated(rng, b"".join(rng.choices(packages, k=rng.randint(1, 10))))


@pytest.mark.parametrize("version", [1, 2])
@pytest.mark.parametrize("side", ["client", "controller"])
def test_hostile_bytes_give_messages_or_a_protocol_error(side: str, version: int) -> None:
    """Nothing else is raised, nothing grows, and the error is final."""
    rng = random.Random(f"{side}{version}")
    errors = 0
    for _ in range(CASES // 4):
        speaker, listener = ControllerProtocol(), ClientProtocol()
        if version == 2:
            for _ in speaker.receive(listener.send(messages.RequestProtocolVersion(2))):
                list(listener.receive(speaker.send(messages.ProtocolVersionReply(True))))
        if side == "client":
            packages = [speaker.send(message) for message in FROM_CONTROLLER]
            errors += feed(rng, packages, listener, CONTROLLER_TYPES)
        else:
            packages = [listener.send(message) for message in FROM_CLIENT]
            errors += feed(rng, packages, speaker, CLIENT_TYPES)
    assert errors > CASES // 40


def feed(
    rng: random.Random,
    packages: list[bytes],
    listener: ClientProtocol | ControllerProtocol,
    expected: tuple[type, ...],
) -> int:
    for segment in segments(rng, streams(rng, packages)):
        try:
            for message in listener.receive(segment):
                assert isinstance(message, (*expected, StrangePackage))
                if isinstance(message, messages.DataPackage):
                    unpack(message)
        except ProtocolError:
            with pytest.raises(ProtocolError, match="at byte"):
                listener.receive(b"")
            assert listener.buffered == 0
            return 1
        assert listener.buffered < MAX_PACKAGE
    return 0


def unpack(package: messages.DataPackage) -> None:
    try:
        assert len(RECIPE.unpack(package.payload)) == 8
    except ProtocolError:
        assert len(package.payload) != RECIPE.size
