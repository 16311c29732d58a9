"""What the demonstration says at its end, and whether it has shown what it is for."""

from __future__ import annotations

from gatewayd.demo.master import CHECKS
from gatewayd.demo.plc import CHECKS_PER_HANDSHAKE
from gatewayd.demo.scene import Scene

_LONG_ENOUGH = 3
"""Handshakes within which the CANopen side must have come to work."""


def summary(scene: Scene, *, asked_for: bool) -> tuple[bool, str]:
    """Whether the main job worked, and the closing words.

    A demonstration whose length was asked for must have seen a handshake, and values on CANopen; one that was broken
    off need not.
    """
    program, health = scene.plc.program, scene.cell.health
    master, feeder = scene.master, scene.master.feeder
    counts = (
        f"{health.packages} packages from the robot ({health.skipped} skipped), "
        f"{program.handshakes} handshakes, {program.verified} values checked both ways, "
        f"{health.writes_refused} {'write' if health.writes_refused == 1 else 'writes'} refused.\n"
        f"CANopen: {master.heartbeats} heartbeats, {master.received} PDOs received, {master.sent} sent, "
        f"{feeder.verified} values checked, {feeder.refusals} "
        f"{'order' if feeder.refusals == 1 else 'orders'} overruled by the PLC."
    )
    silent = ["the CANopen node fell silent"] if master.gone else []
    wrong = [*program.wrong, *feeder.wrong, *silent, *scene.problems]
    if wrong:
        reasons = "; ".join(wrong)
        return False, f"{counts}\nThat is not how it should be: {reasons}"
    if program.handshakes == 0 or program.verified < CHECKS_PER_HANDSHAKE:
        what = "The PLC and the robot never shook hands" + ("." if asked_for else ": it was over too soon.")
        return not asked_for, f"{counts}\n{what}"
    if feeder.verified < CHECKS:
        what = "The CANopen master and the node never agreed" + (
            "." if asked_for else ": it was over too soon."
        )
        return not (asked_for or program.handshakes >= _LONG_ENOUGH), f"{counts}\n{what}"
    parts = program.handshakes
    made = "1 part ordered, 1 part made" if parts == 1 else f"{parts} parts ordered, {parts} parts made"
    return True, (
        f"{counts}\n{made}, 0 excuses. The robot counted the same as the PLC.\n"
        "Next: docs/tutorial leads from here to your own robot."
    )
