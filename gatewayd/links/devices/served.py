"""What the running gateway knows of a device: what it serves need not be looked at again."""

from __future__ import annotations

from gatewayd.core.definition import CellDefinition
from gatewayd.links.devices.plan import DevicePlan
from gatewayd.links.examination import Observation, Outcome, Surroundings

_SERVED = ("good", "partial")


def served_device(
    plan: DevicePlan, cell: CellDefinition, around: Surroundings, address: str, remedy: str
) -> Observation | None:
    """How a running gateway has the device of this name at `address`; None: none has it. `remedy`: where it is lost."""
    for known in around.running:
        served = known.status.get(plan.name) if known.name == cell.name else None
        if served and served.get("address") == address:
            return _observed(str(served.get("state")), str(served.get("reason") or ""), remedy)
    return None


def _observed(state: str, reason: str, remedy: str) -> Observation:
    text = f"the running gateway has it: {state}"
    if state in _SERVED:
        return Observation.well("device", text)
    return Observation("device", Outcome.PROBLEM, text, reason or "it does not answer", remedy)
