"""Rules GW206 to GW208, GW216, GW217, GW219, GW224 and GW225: the Modbus listener, its units and its peers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from ipaddress import IPv4Address, IPv6Address, ip_address, ip_network

from gatewayd.links.modbus_server.plan import Network, network_text
from gatewayd.links.modbus_server.roles import role_writers
from gatewayd.links.modbus_server.sections import Modbus, ModbusWriter
from gatewayd.mapping.diagnostics import Diagnostic, Position, Related, Rule, Severity
from gatewayd.mapping.document import Part
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.mapping.rules.registry import cell_rule, plant_rule
from gatewayd.mapping.scalars import ListenAddress
from gatewayd.report.format import counted

_LOOPBACK = (ip_network("127.0.0.0/8"), ip_network("::1/128"))
_EXAMPLES = {4: "192.0.2.2:502", 6: "[fd00::2]:502"}
_EVERYWHERE = (ip_network("0.0.0.0/0"), ip_network("::/0"))
_SECURED = ("tls", "listen")
_SHARED = ("connections", "connections_per_peer", "idle_timeout")


@plant_rule("GW206")
def unit_clash(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """Two cells with the same unit on one listener."""
    first: dict[tuple[str, int], tuple[ExpandedCell, Part[Modbus]]] = {}
    for cell, modbus, _path, address in _listeners(cells):
        listen, unit = str(address), modbus.spec.unit
        if (listen, unit) not in first:
            first[listen, unit] = cell, modbus
            continue
        other, earlier = first[listen, unit]
        if earlier is modbus:
            continue  # with TLS and without: GW230
        message = f"unit {unit} at {listen} already belongs to the cell `{other.document.cell}`"
        related = (Related(earlier.at("unit"), f"unit {unit} first used here"),)
        hint = "give this cell another `unit`, or another `listen` address"
        yield rule.at(modbus.at("unit"), message, hint=hint, related=related)


@plant_rule("GW207")
def listen_clash(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """Two listeners that ask for the same port."""
    by_port: dict[int, list[tuple[Position, ListenAddress]]] = {}
    for _cell, modbus, path, listen in _listeners(cells):
        known = by_port.setdefault(listen.port, [])
        other = next((item for item in known if _clash(item[1].host, listen.host)), None)
        if other is not None:
            message = f"{listen} cannot be opened beside {other[1]}: both want port {listen.port}"
            related = (Related(other[0], f"{other[1]} is here"),)
            hint = f"write {other[1]} here too (the units differ), or use another port"
            yield rule.at(modbus.at(*path), message, hint=hint, related=related)
        known.append((modbus.at(*path), listen))


@plant_rule("GW208", Severity.WARNING)
def listener_settings(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """Cells on one listener disagree about its connections."""
    first: dict[str, tuple[ExpandedCell, Part[Modbus]]] = {}
    for cell, modbus, _path, listen in _listeners(cells):
        other, earlier = first.setdefault(str(listen), (cell, modbus))
        for key in _SHARED:
            if getattr(modbus.spec, key) != getattr(earlier.spec, key):
                message = (
                    f"`{key}` of {listen} differs from that of the cell `{other.document.cell}`; "
                    "the most generous one applies"
                )
                related = (Related(earlier.at(key), f"`{key}` of `{other.document.cell}`"),)
                hint = f"write the same `{key}` in both files"
                yield rule.at(modbus.at(key), message, hint=hint, related=related)


@cell_rule("GW216")
def writer_shut_out(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A writer that the access list does not let in."""
    modbus = cell.document.part(Modbus)
    if modbus is None or not modbus.spec.allow:
        return
    for writer in cell.document.writers.values():
        networks = writer.spec.by(ModbusWriter).modbus
        if networks and not _meet(networks, modbus.spec.allow):
            shown = ", ".join(map(network_text, networks[:3]))
            message = f"the access list of the listener shuts out the writer `{writer.name}` ({shown})"
            related = (Related(modbus.at("allow"), "the access list is here"),)
            hint = f"add {network_text(networks[0])} to `allow`"
            yield rule.at(writer.at("modbus"), message, hint=hint, related=related)


@cell_rule("GW217", Severity.WARNING)
def open_listener(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A listener on every address without an access list."""
    modbus = cell.document.part(Modbus)
    if modbus is None or ("listen",) not in modbus.spec.addresses:
        return
    if not modbus.spec.allow and ip_address(modbus.spec.listen.host).is_unspecified:
        message = f"{modbus.spec.listen} serves every network of this machine, and there is no access list"
        hint = "add `allow: [192.0.2.0/24]` with the networks that may connect"
        yield rule.at(modbus.at("listen"), message, hint=hint)


@cell_rule("GW219", Severity.WARNING)
def unreachable_listener(rule: Rule, cell: ExpandedCell) -> Iterator[Diagnostic]:
    """A writer elsewhere, and a listener that it cannot reach."""
    for _cell, modbus, path, address in _listeners([cell]):
        yield from _unreachable(rule, cell, modbus, path, address)


def _unreachable(
    rule: Rule, cell: ExpandedCell, modbus: Part[Modbus], path: tuple[str, ...], address: ListenAddress
) -> Iterator[Diagnostic]:
    listen = ip_address(address.host)
    if _is_nobodys(listen):
        message = f"nobody can connect to {address}: no machine has this address as its own"
        yield rule.at(modbus.at(*path), message, hint="write an address of this machine, or 0.0.0.0")
        return
    if isinstance(listen, IPv6Address) and listen.is_link_local and not listen.scope_id:
        message = f"{address} cannot be listened on: a link-local address needs its interface"
        yield rule.at(modbus.at(*path), message, hint=f"write [{listen}%eth0]:{address.port}")
        return
    near = _LOOPBACK if listen.is_loopback else _EVERYWHERE
    reached = [network for network in near if network.version == listen.version]
    who = "this machine" if listen.is_loopback else f"peers with an address of IPv{listen.version}"
    if modbus.spec.allow and not _meet(modbus.spec.allow, reached):
        message = f"the access list lets nobody in: {address} is only for {who}"
        yield rule.at(
            modbus.at("allow"), message, hint="name networks of peers that can reach it, or remove the list"
        )
    for writer in cell.document.writers.values():
        spec = writer.spec.by(ModbusWriter)
        networks = spec.modbus
        # By an address alone a writer may come by either; by its role only with TLS.
        only_here = path == _SECURED or spec.role is None
        elsewhere = len(modbus.spec.addresses) > 1 and spec.role is None and path == _SECURED
        if networks and only_here and not elsewhere and not _meet(networks, reached):
            message = (
                f"the writer `{writer.name}` ({network_text(networks[0])}) cannot reach {address}, "
                f"which is only for {who}"
            )
            related = (Related(modbus.at(*path), f"the listener is {address}"),)
            hint = f"listen on this machine's address in that network, for example {_EXAMPLES[networks[0].version]}"
            yield rule.at(writer.at("modbus"), message, hint=hint, related=related)


@plant_rule("GW224")
def default_unit_clash(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """Two cells on one listener that both answer to unit ids 0 and 255."""
    first: dict[str, tuple[ExpandedCell, Part[Modbus]]] = {}
    for cell, modbus, _path, listen in _listeners(cells):
        if not modbus.spec.default_unit:
            continue
        other, earlier = first.setdefault(str(listen), (cell, modbus))
        if earlier is not modbus:
            message = f"`default_unit` of {listen} already belongs to the cell `{other.document.cell}`"
            related = (Related(earlier.at("default_unit"), f"`default_unit` of `{other.document.cell}`"),)
            hint = "leave `default_unit: true` with one of the two"
            yield rule.at(modbus.at("default_unit"), message, hint=hint, related=related)


@plant_rule("GW225", Severity.WARNING)
def too_few_connections(rule: Rule, cells: Sequence[ExpandedCell]) -> Iterator[Diagnostic]:
    """A listener with no connection beyond those kept for its writers."""
    peers: dict[str, set[object]] = {}
    widest: dict[str, Part[Modbus]] = {}
    for cell, modbus, path, address in _listeners(cells):
        listen = str(address)
        its = peers.setdefault(listen, set())
        for writer in cell.document.writers.values():
            spec = writer.spec.by(ModbusWriter)
            if path == _SECURED:
                its.update(known.text for known in role_writers(spec, 0))
            elif spec.role is None:
                its.update(spec.modbus)
        if modbus.spec.connections > widest.setdefault(listen, modbus).spec.connections:
            widest[listen] = modbus
    for listen, modbus in widest.items():
        connections, needed = modbus.spec.connections, len(peers[listen])
        if connections <= needed:
            has = counted(connections, "connection")
            message = (
                f"{listen} has {has} for {counted(needed, 'address')} of writers, each of which keeps one"
            )
            hint = f"write `connections: {needed + 4}` or more, for a second connection and for those that only read"
            yield rule.at(modbus.at("connections"), message, hint=hint)


def _listeners(
    cells: Sequence[ExpandedCell],
) -> Iterator[tuple[ExpandedCell, Part[Modbus], tuple[str, ...], ListenAddress]]:
    """Each address that is listened on, and the path of its key."""
    for cell in cells:
        modbus = cell.document.part(Modbus)
        if modbus is not None:
            for path, listen in modbus.spec.addresses.items():
                yield cell, modbus, path, listen


def _clash(host: str, other: str) -> bool:
    if host == other:
        return False
    first, second = ip_address(host), ip_address(other)
    # The wildcard of IPv6 leaves the ports of IPv4 alone: asyncio opens it for IPv6 only.
    return first.version == second.version and (first.is_unspecified or second.is_unspecified)


def _meet(networks: Sequence[Network], allowed: Sequence[Network]) -> bool:
    """Whether any of them has an address of a peer that is allowed."""
    return any(
        item.version == network.version and item.overlaps(network)
        for network in networks
        if not _is_nobodys(network) and not (network.is_unspecified and network.num_addresses == 1)
        for item in allowed
    )


def _is_nobodys(place: IPv4Address | IPv6Address | Network) -> bool:
    """Whether no peer can connect from it or to it: addresses of groups, and of IPv4 those from 240.0.0.0 on."""
    return place.is_multicast or (place.version == 4 and place.is_reserved)
