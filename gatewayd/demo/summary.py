"""What the demonstration says at its end, and whether it has shown what it is for."""

from __future__ import annotations

from gatewayd.demo.master import CHECKS
from gatewayd.demo.plc import CHECKS_PER_HANDSHAKE
from gatewayd.demo.scene import Scene
from gatewayd.report.format import counted

_LONG_ENOUGH = 3
"""Handshakes within which the CANopen side and the island must have come to work."""


def summary(scene: Scene, *, asked_for: bool) -> tuple[bool, str]:
    """Whether the main job worked, and the closing words.

    A demonstration whose length was asked for must have seen a handshake, and values on CANopen; one that was broken
    off need not.
    """
    program, health = scene.plc.program, scene.cell.health
    master, feeder, terminals = scene.master, scene.master.feeder, scene.island.terminals
    counts = (
        f"{counted(health.packages, 'package')} from the robot ({health.skipped or 'none'} skipped), "
        f"{counted(program.handshakes, 'handshake')}, {counted(program.verified, 'value')} checked both ways, "
        f"{counted(health.writes_refused, 'write')} refused.\n"
        f"CANopen: {counted(master.heartbeats, 'heartbeat')}, {counted(master.received, 'PDO')} received, "
        f"{master.sent or 'none'} sent, {counted(feeder.verified, 'value')} checked, "
        f"{counted(feeder.refusals, 'order')} overruled by the PLC.\n"
        f"Island: {counted(terminals.requests, 'request')}, clamp closed {counted(terminals.closed, 'time')}."
    )
    silent = ["the CANopen node fell silent"] if master.gone else []
    refused = ["the island refused requests"] if terminals.refused else []
    wrong = [*program.wrong, *feeder.wrong, *silent, *refused, *scene.problems]
    if wrong:
        reasons = "; ".join(wrong)
        return False, f"{counts}\nSomething went wrong: {reasons}"
    if program.handshakes == 0 or program.verified < CHECKS_PER_HANDSHAKE:
        what = "The PLC and the robot never shook hands" + ("." if asked_for else ": it was over too soon.")
        return not asked_for, f"{counts}\n{what}"
    if feeder.verified < CHECKS:
        what = "The CANopen master and the node never agreed" + (
            "." if asked_for else ": it was over too soon."
        )
        return not (asked_for or program.handshakes >= _LONG_ENOUGH), f"{counts}\n{what}"
    if terminals.closed == 0:
        what = "The clamp never closed" + ("." if asked_for else ": it was over too soon.")
        return not (asked_for or program.handshakes >= _LONG_ENOUGH), f"{counts}\n{what}"
    parts = program.handshakes
    made = f"{counted(parts, 'part')} ordered, {counted(parts, 'part')} made"
    return True, (
        f"{counts}\n{made}: the robot counted the same as the PLC.\n"
        "Next: docs/tutorial takes you from here to your own robot."
    )
