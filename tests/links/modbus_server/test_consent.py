"""What of a changed listener with TLS nobody does unasked."""

from __future__ import annotations

import pytest

from gatewayd.links.modbus_server.consent import weakened
from gatewayd.links.modbus_server.plan import ModbusPlan
from tests.links.modbus_server.test_roles import HEAD, compiled

BASE = "      operator: {read: all, write: [motion]}\n      b: {read: cycles}\n"


@pytest.mark.parametrize(
    "roles,head,expected",
    [
        (BASE, HEAD, []),
        (BASE.replace("read: cycles", "read: [cycles, go]"), HEAD, ["the role `b` could read `go` too"]),
        (
            BASE.replace("[motion]", "[motion, recipe]"),
            HEAD,
            ["the role `operator` could write `recipe[0]` and `recipe[1]` too"],
        ),
        (BASE.replace("[motion]", "all"), HEAD, ["the role `operator` could write everything"]),
        (BASE.replace("[motion]", "[go]"), HEAD, []),
        (BASE + "    without_role: {read: go}\n", HEAD, ["certificates without a role could read `go` too"]),
        (BASE + "      c: {read: go}\n", HEAD, ["the role `c` could read `go` too"]),
        (
            BASE,
            HEAD.replace("/a.crt", "/b.crt"),
            ["other authorities would let clients in: clients /a.crt -> /b.crt"],
        ),
        (
            BASE,
            HEAD.replace("modbus:\n", "modbus:\n  listen: 127.0.0.1:502\n"),
            ["clients could connect to modbus without TLS too"],
        ),
    ],
)
def test_more_than_before_needs_consent(roles: str, head: str, expected: list[str]) -> None:
    before, after = compiled(BASE), compiled(roles, head)
    found = weakened(before.the(ModbusPlan), after.the(ModbusPlan), before.cell, after.cell)
    assert list(found) == expected


def test_a_list_of_the_revoked_that_goes() -> None:
    before = compiled(BASE, HEAD.replace("    clients", "    revoked: /r.crl\n    clients"))
    after = compiled(BASE)
    found = weakened(before.the(ModbusPlan), after.the(ModbusPlan), before.cell, after.cell)
    assert list(found) == ["revoked certificates would be accepted: revoked none"]
