"""The end of the demonstration: exit code and last words."""

from __future__ import annotations

from gatewayd.demo.scene import Scene
from gatewayd.demo.summary import summary


async def test_handshakes_pass(scene: Scene) -> None:
    scene.plc.program.handshakes, scene.plc.program.verified = 8, 24
    passed, text = summary(scene, asked_for=True)
    assert passed
    assert "8 parts ordered, 8 parts made, 0 excuses" in text


async def test_no_handshake_fails_unless_it_was_broken_off(scene: Scene) -> None:
    scene.plc.program.handshakes = scene.plc.program.verified = 0
    assert not summary(scene, asked_for=True)[0]
    assert summary(scene, asked_for=False)[0]


async def test_wrong_values_fail(scene: Scene) -> None:
    scene.plc.program.handshakes, scene.plc.program.verified = 8, 24
    scene.plc.program.wrong.append("force is 1, expected 2")
    passed, text = summary(scene, asked_for=False)
    assert not passed
    assert "force is 1, expected 2" in text
