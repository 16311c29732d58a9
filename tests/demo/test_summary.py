"""The end of the demonstration: exit code and last words."""

from __future__ import annotations

import time

from gatewayd.demo.scene import Scene
from gatewayd.demo.summary import summary


def play(scene: Scene) -> None:
    """Everything has worked."""
    scene.plc.program.handshakes, scene.plc.program.verified = 8, 24
    scene.master.feeder.verified = 5
    scene.island.terminals.closed = 8


async def test_handshakes_pass(scene: Scene) -> None:
    play(scene)
    passed, text = summary(scene, asked_for=True)
    assert passed
    assert "8 parts ordered, 8 parts made: the robot counted the same" in text


async def test_no_handshake_fails_unless_it_was_broken_off(scene: Scene) -> None:
    play(scene)
    scene.plc.program.handshakes = scene.plc.program.verified = 0
    assert not summary(scene, asked_for=True)[0]
    assert summary(scene, asked_for=False)[0]


async def test_silent_node_fails_unless_it_was_broken_off(scene: Scene) -> None:
    play(scene)
    scene.master.feeder.verified = 0
    passed, text = summary(scene, asked_for=True)
    assert not passed
    assert "never agreed" in text
    assert not summary(scene, asked_for=False)[0], "eight handshakes are long enough"
    scene.plc.program.handshakes = 1
    assert summary(scene, asked_for=False)[0]


async def test_clamp_that_never_closed_fails(scene: Scene) -> None:
    play(scene)
    scene.island.terminals.closed = 0
    passed, text = summary(scene, asked_for=True)
    assert not passed
    assert "The clamp never closed." in text
    scene.plc.program.handshakes = 1
    assert summary(scene, asked_for=False)[0]


async def test_refused_requests_of_the_island_fail(scene: Scene) -> None:
    play(scene)
    scene.island.terminals.refused = 1
    passed, text = summary(scene, asked_for=False)
    assert not passed
    assert "the island refused requests" in text


async def test_node_lost_at_the_end_fails(scene: Scene, until) -> None:  # type: ignore[no-untyped-def]
    await until(lambda: scene.master.operational(time.monotonic()))
    play(scene)
    scene.master.gone = True
    passed, text = summary(scene, asked_for=False)
    assert not passed
    assert "the CANopen node fell silent" in text


async def test_wrong_values_on_canopen_fail(scene: Scene) -> None:
    play(scene)
    scene.master.feeder.wrong.append("cycles went from 3 to 5")
    passed, text = summary(scene, asked_for=False)
    assert not passed
    assert "cycles went from 3 to 5" in text


async def test_wrong_values_fail(scene: Scene) -> None:
    play(scene)
    scene.plc.program.wrong.append("force is 1, expected 2")
    passed, text = summary(scene, asked_for=False)
    assert not passed
    assert "force is 1, expected 2" in text
