"""What a role may do with one unit, without any socket."""

from __future__ import annotations

from collections.abc import Callable

from gatewayd.core.requester import Requester
from gatewayd.links.modbus_server.functions import Unit, execute
from gatewayd.links.modbus_server.plan import RoleRights
from gatewayd.links.modbus_server.rights import Rights
from tests.links.modbus_server.conftest import HMI, NOW, PLC

IndexOf = Callable[[str], int]


def ask(unit: Unit, rights: RoleRights, pdu: str, writer: int | None = PLC) -> str:
    limited = unit.limited(Rights(unit.plan, rights))
    return execute(limited, Requester(writer, "127.0.0.1 (role x)", 1), bytes.fromhex(pdu), NOW).hex(" ")


def test_without_any_right_everything_is_refused_the_same_way(unit: Unit) -> None:
    nothing = RoleRights("x")
    for function in ("01", "03", "06", "0f", "10", "11", "16", "17", "2b", "63"):
        assert ask(unit, nothing, function + " 000a 0001") == f"{int(function, 16) | 0x80:02x} 01"
    assert unit.cell.last_refusal is None
    assert sum(unit.cell.health.unserved.values()) == 10


def test_a_register_with_a_hidden_bit_cannot_be_read(unit: Unit, index_of: IndexOf) -> None:
    rights = RoleRights("x", (index_of("start"), index_of("int_0")))
    assert ask(unit, rights, "03 0000 0001") == "83 01"
    assert ask(unit, rights, "03 0064 0002") == "03 04 00 00 00 00"
    assert ask(unit, rights, "04 0000 0002") == "04 04 00 00 00 00", "the same variable in another area"
    assert ask(unit, rights, "03 0066 0002") == "83 01"
    assert ask(unit, rights, "02 0003 0001") == "82 01"
    assert ask(unit, rights, "03 0001 0001") == "83 02", "nothing is mapped there"
    assert ask(unit, rights, "03 0001 0000") == "83 03", "no quantity at all"


def test_a_bit_that_only_shares_a_register_stands_in_nobodys_way(unit: Unit, index_of: IndexOf) -> None:
    rights = RoleRights("x", None, (index_of("mode"),))
    assert ask(unit, rights, "16 0000 7fff 8000", HMI) == "16 00 00 7f ff 80 00", "mode alone"
    assert ask(unit, rights, "06 0000 8001", HMI) == "86 01", "start is changed with it"
    refused = unit.cell.last_refusal
    assert refused is not None
    assert refused.refusal.variable == index_of("start")


def test_a_coil_is_a_right_of_its_own(unit: Unit, index_of: IndexOf) -> None:
    rights = RoleRights("x", (), (index_of("coil_0"), index_of("coil_1")))
    for _ in range(2):
        assert ask(unit, rights, "0f 0000 0002 01 03") == "0f 00 00 00 02"
    assert ask(unit, rights, "0f 0000 0003 01 07") == "8f 01"
    assert ask(unit, rights, "05 0002 ff00") == "85 01"
    assert ask(unit, rights, "01 0000 0001") == "81 01", "it may not read"


def test_what_is_usual_to_one_role_is_not_to_another(unit: Unit, index_of: IndexOf) -> None:
    """The unit remembers writes that were accepted; what a role may write is looked at each time."""
    write, right = "06 000a 0007", RoleRights("x", None, (index_of("part"),))
    for _ in range(2):
        assert ask(unit, right, write) == "06 00 0a 00 07"
    assert ask(unit, RoleRights("y", None, (index_of("count"),)), write) == "86 01"
    assert ask(unit, RoleRights("z", None), write) == "86 01"


def test_ownership_comes_after_the_role(unit: Unit, index_of: IndexOf) -> None:
    rights = RoleRights("x", None, (index_of("start"),))
    assert ask(unit, rights, "05 0000 ff00") == "85 01"
    assert ask(unit, rights, "16 0000 fffe 0001", HMI) == "96 02", "start is plc's alone"
    assert ask(unit, rights, "06 0000 0001", None) == "86 02", "no writer"
    assert ask(unit, RoleRights("x", None), "06 0000 0001", None) == "86 01"


def test_read_and_write_in_one_request_needs_both_rights(unit: Unit, index_of: IndexOf) -> None:
    both = "17 000a 0001 000a 0001 02 0007"
    part = (index_of("part"),)
    assert ask(unit, RoleRights("x", part, part), both) == "17 02 00 07"
    assert ask(unit, RoleRights("x", part, ()), both) == "97 01"
    assert ask(unit, RoleRights("x", (), part), both) == "97 01"


def test_gaps_are_counted_with_the_unit(unit: Unit) -> None:
    limited = unit.limited(Rights(unit.plan, RoleRights("x", None)))
    limited.ignored += 3
    assert unit.ignored == 3
