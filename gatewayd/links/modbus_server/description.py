"""The plan of a Modbus unit in words."""

from __future__ import annotations

from gatewayd.core.definition import CellDefinition
from gatewayd.links.contract import Description, Place
from gatewayd.links.modbus_places.describing import encoding_text, type_text
from gatewayd.links.modbus_server.plan import (
    ModbusPlan,
    Placement,
    RoleRights,
    SecuredPlan,
    network_text,
)
from gatewayd.modbus.areas import AREA_NAMES
from gatewayd.report.format import address, seconds


def description(plan: ModbusPlan, cell: CellDefinition) -> Description:
    """Settings, places of variables, networks of writers."""
    places: dict[int, list[Place]] = {}
    for placement in plan.placements:
        places.setdefault(placement.variable, []).append(_place(placement))
    networks: dict[int, list[str]] = {}
    for network, writer in plan.writers:
        networks.setdefault(writer, []).append(network_text(network))
    for known in plan.tls.writers if plan.tls is not None else ():
        networks.setdefault(known.writer, []).append(known.text)
    listen = address(plan.host, plan.port)
    return Description(
        settings={
            "listen": listen,
            "unit": str(plan.unit),
            "default_unit": "true" if plan.default_unit else "false",
            "allow": ", ".join(map(network_text, plan.allow)) or "everybody",
            "connections": str(plan.connections),
            "connections_per_peer": str(plan.connections_per_peer or "half of them, at least 4"),
            "idle_timeout": seconds(plan.idle_timeout) or "none",
            "gaps": "zero" if plan.fill_gaps else "refuse",
            "write_gaps": "ignore" if plan.ignore_gaps else "refuse",
            "robot_away": plan.robot_away.name.lower(),
            **({} if plan.tls is None else _secured(plan.tls, cell)),
            **({} if plan.plain else {"without TLS": "no"}),
        },
        places=places,
        writers={writer: ", ".join(its) for writer, its in networks.items()},
        address=f"{listen}{beside(plan)} unit {plan.unit}",
        fields={"listen": listen, "unit": plan.unit},
    )


def beside(plan: ModbusPlan) -> str:
    """The listener with TLS, where there is one."""
    if plan.tls is None:
        return ""
    return f" and {address(plan.tls.host, plan.tls.port)} with TLS" if plan.plain else " with TLS"


def _secured(tls: SecuredPlan, cell: CellDefinition) -> dict[str, str]:
    """Each role is a setting: a role that is given a right, or loses one, is seen by name."""
    files = tls.files
    return {
        "tls listen": address(tls.host, tls.port),
        "tls certificate": files.certificate,
        "tls key": files.key,
        "tls clients": files.clients,
        "tls revoked": files.revoked or "none",
        **{
            "without role" if its.role is None else f"role {its.role}": rights_text(its, cell)
            for its in tls.roles
        },
    }


def rights_text(rights: RoleRights, cell: CellDefinition) -> str:
    """`read all, write part_number recipe[0]`."""
    return f"read {_names(rights.readable, cell)}, write {_names(rights.writable, cell)}"


def _names(indices: tuple[int, ...] | None, cell: CellDefinition) -> str:
    if indices is None:
        return "all"
    return " ".join(cell.variables[index].name for index in indices) or "nothing"


def _place(placement: Placement) -> Place:
    """`holding 100 (400101) int32`, `holding 0.3 (400001.3)`, `coil 5 (000006)`."""
    area, notation, codec = AREA_NAMES[placement.area], placement.notation, placement.codec
    return Place(
        text=f"{area} {placement.place} ({notation}){encoding_text(codec)}",
        fields={"area": area, "address": placement.address, "bit": placement.bit, "notation": notation},
        area=area,
        address=placement.place,
        notation=notation,
        type=type_text(codec),
    )
