"""The plan of a Modbus device in words."""

from __future__ import annotations

from typing import Final

from gatewayd.core.definition import CellDefinition
from gatewayd.links.contract import Description, Place
from gatewayd.links.devices.modbus.plan import DevicePlacement, ModbusDevicePlan
from gatewayd.links.devices.plan import DevicePlan, Sending
from gatewayd.links.modbus_places.describing import encoding_text, type_text
from gatewayd.modbus.areas import AREA_NAMES
from gatewayd.report.format import seconds


def describe(plan: DevicePlan, _cell: CellDefinition) -> Description:
    """Settings, places of variables, address."""
    assert isinstance(plan, ModbusDevicePlan)
    sendings = {sending.variable: sending for sending in plan.sendings}
    places: dict[int, list[Place]] = {}
    for placed in plan.placements:
        places.setdefault(placed.variable, []).append(
            _place(plan.name, placed, sendings.get(placed.variable))
        )
    where = f"{plan.line.text} unit {plan.unit}"
    return Description(
        settings={
            "reached by": plan.line.text,
            "unit": str(plan.unit),
            "timeout": seconds(plan.timeout) or "",
            "failures": str(plan.failures),
            "gap": str(plan.gap) if plan.gap else "",
            "single": "true" if plan.single else "",
            "connect": "per_request" if plan.per_request else "",
            "in_flight": str(plan.in_flight) if plan.in_flight > 1 else "",
            "write": "" if plan.write == "auto" else plan.write,
            "mask_write": "" if plan.mask_write else "false",
            "poll": "" if any(placed.poll for placed in plan.placements) else seconds(plan.poll),
            "identify": "true" if plan.identify else "",
            "serial_number": _registers(plan.serial_number),
        },
        places=places,
        address=where,
        fields={"address": plan.line.text, "unit": plan.unit},
    )


def _registers(found: tuple[int, int] | None) -> str:
    return "" if found is None else f"{found[0]}..{found[0] + found[1] - 1}"


def _place(device: str, placed: DevicePlacement, sending: Sending | None) -> Place:
    """`island discrete 3 (100004)`, `gripper holding 1002.0..7 (401003.0..7) uint16`."""
    area, codec = AREA_NAMES[placed.area], placed.codec
    poll = f" every {seconds(placed.poll)}" if placed.poll is not None else ""
    rest = {None: "", True: ", rest kept", False: ", rest 0"}[placed.keeps_rest]
    return Place(
        text=f"{area} {placed.place} ({placed.notation}){encoding_text(codec)}{poll}{rest}{_sending(sending)}",
        fields={
            "device": device,
            "area": area,
            "address": placed.address,
            "bit": placed.bit,
            "width": placed.width or None,
            "notation": placed.notation,
        },
        area=area,
        address=placed.place,
        notation=placed.notation,
        type=type_text(codec),
    )


def _sending(sending: Sending | None) -> str:
    if sending is None:
        return ""
    again = f", again every {seconds(sending.every)}" if sending.every is not None else ""
    return (", written on connect" if sending.brings_up_to_date else "") + again


FAMILY: Final = describe
"""Puts plans of this family into words."""
