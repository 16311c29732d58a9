"""The plan of a CANopen device in words."""

from __future__ import annotations

from typing import Final

from gatewayd.core.definition import CellDefinition
from gatewayd.links.contract import Description, Place
from gatewayd.links.devices.canopen.plan import WORDS, CanopenDevicePlan, ObjectPlace
from gatewayd.links.devices.plan import DevicePlan, Sending
from gatewayd.report.format import seconds


def describe(plan: DevicePlan, _cell: CellDefinition) -> Description:
    """Settings, places of variables, address."""
    assert isinstance(plan, CanopenDevicePlan)
    node = plan.node
    sendings = {sending.variable: sending for sending in plan.sendings}
    places: dict[int, list[Place]] = {}
    for place in plan.places:
        places.setdefault(place.variable, []).append(_place(plan, place, sendings.get(place.variable)))
    expected = node.expected
    return Description(
        settings={
            "reached by": plan.bus.address,
            "node": str(node.node),
            "vendor": "" if expected.vendor is None else f"0x{expected.vendor:X}",
            "product": "" if expected.product is None else f"0x{expected.product:X}",
            "revision": "" if expected.revision is None else f"0x{expected.revision:X}",
            "expected_serial": "" if expected.serial is None else f"0x{expected.serial:X}",
            "software": node.software or "",
            "heartbeat": seconds(node.heartbeat or None) or "none",
            "mandatory": "true" if node.mandatory else "",
            "keep": "true" if node.keep else "",
            "store": "true" if node.store else "",
            "written before the start": ", ".join(
                f"{setting.index:04X}h:{setting.subindex:02X}" for setting in node.settings
            ),
            "PDOs": ", ".join(
                f"{pdo.label} {pdo.cob_id:03X}h ({'laid out' if pdo.written else 'as it is'})"
                for pdo in node.pdos
            ),
            "sync": seconds(plan.bus.sync.period / 1e6 or None) or "",
            "manager": "" if plan.bus.node is None else str(plan.bus.node),
            "manager_heartbeat": seconds(plan.bus.heartbeat / 1000 or None) or "",
        },
        places=places,
        address=plan.address,
        fields={"address": plan.bus.address, "unit": node.node},
    )


def _place(plan: CanopenDevicePlan, place: ObjectPlace, sending: Sending | None) -> Place:
    """`object 6004h:00 int32, TPDO 1`, `object 2000h:01 uint16, SDO every 100ms`."""
    if place.pdo is not None:
        way = plan.node.pdos[place.pdo].label
    else:
        way = "SDO" + (f" every {seconds(place.poll)}" if place.poll is not None else "")
    kind = WORDS[place.type]
    again = "" if sending is None or sending.every is None else f", again every {seconds(sending.every)}"
    connect = ", written on connect" if sending is not None and sending.brings_up_to_date else ""
    scale = "" if place.linear is None else f" * {place.linear[0]:g} + {place.linear[1]:g}"
    return Place(
        text=f"object {place.address} {kind}{scale}, {way}{connect}{again}",
        fields={
            "device": plan.name,
            "area": "object",
            "address": place.index,
            "bit": None,
            "width": None,
            "notation": place.address,
        },
        area="object",
        address=place.address,
        notation=way,
        type=kind,
    )


FAMILY: Final = describe
"""Puts plans of this family into words."""
