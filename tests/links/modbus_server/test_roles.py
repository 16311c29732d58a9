"""Roles from the file to the plan."""

from __future__ import annotations

from gatewayd.links.modbus_server.plan import ModbusPlan, RoleRights
from gatewayd.mapping.loader import load
from gatewayd.mapping.plan import Plan

HEAD = """\
gatewayd: 1
cell: press
robot: {host: robot}
modbus:
  tls:
    certificate: /c.crt
    key: /c.key
    clients: /a.crt
    roles:
"""
REST = """\
writers:
  plc: {role: operator, timeout: 1s}
  near: {role: operator, modbus: [192.0.2.0/24, 192.0.2.7], timeout: 1s}
  old: {modbus: 192.0.2.9, timeout: 1s}
groups: {motion: {owner: plc}}
variables:
  go: {robot: input_bit_register_0, modbus: 0.0, group: motion}
  speed: {robot: input_int_register_0, modbus: 10, group: motion}
  recipe: {robot: 'input_double_register_0..1', modbus: 20, owner: [near, old]}
  cycles: {robot: output_int_register_0, modbus: 100}
"""


def compiled(roles: str, head: str = HEAD) -> Plan:
    loaded = load((head + roles + REST).encode(), "cell.yaml")
    assert loaded.plan is not None, loaded.diagnostics
    return loaded.plan


def test_names_are_lines_variables_and_groups() -> None:
    modbus = compiled(
        "      operator: {read: all, write: [motion, recipe]}\n      b: {read: [cycles, go]}\n"
        "    without_role: {read: cycles}\n"
    ).the(ModbusPlan)
    assert modbus.tls is not None
    assert modbus.tls.roles == (
        RoleRights("b", (0, 4), ()),
        RoleRights("operator", None, (0, 1, 2, 3)),
        RoleRights(None, (4,), ()),
    )
    assert modbus.tls.rights_of("nobody") == RoleRights("nobody", (), ())


def test_a_writer_with_a_role_and_an_address_goes_first() -> None:
    modbus = compiled("      operator: {write: all}\n").the(ModbusPlan)
    assert modbus.tls is not None
    assert [(known.text, known.writer) for known in modbus.tls.writers] == [
        ("role operator at 192.0.2.7", 1),
        ("role operator at 192.0.2.0/24", 1),
        ("role operator", 0),
    ]
    assert [writer for _network, writer in modbus.writers] == [2], "known by an address alone"


def test_without_listen_there_is_no_plain_port() -> None:
    alone = compiled("      operator: {write: all}\n").the(ModbusPlan)
    assert (alone.plain, alone.host, alone.port) == (False, "127.0.0.1", 802)
    assert list(alone.endpoints) == [("127.0.0.1", 802)]
    beside = compiled(
        "      operator: {write: all}\n", HEAD.replace("modbus:\n", "modbus:\n  listen: 127.0.0.1:502\n")
    ).the(ModbusPlan)
    assert (beside.plain, beside.host, beside.port) == (True, "127.0.0.1", 502)
    assert [files is not None for files in beside.endpoints.values()] == [False, True]


def test_a_right_is_part_of_the_fingerprint() -> None:
    one, other = (
        compiled("      operator: {write: all}\n"),
        compiled("      operator: {write: all, read: all}\n"),
    )
    assert one.cell.fingerprint != other.cell.fingerprint


def found(text: str, rule: str) -> int:
    return sum(each.rule.id == rule for each in load(text.encode(), "cell.yaml").diagnostics)


def test_a_listener_with_a_fault_is_not_reported_as_missing() -> None:
    roles = "      operator: {read: all, write: all}\n"
    assert found((HEAD + roles + REST).replace("key: /c.key", "key: c.key"), "GW233") == 0
    assert found(HEAD[: HEAD.index("  tls:")] + "  listen: 127.0.0.1:1502\n" + REST, "GW233") == 2


def test_a_range_without_a_right_is_one_finding() -> None:
    assert found(HEAD + "      operator: {read: all, write: motion}\n" + REST, "GW239") == 1
