from __future__ import annotations

from gatewayd.control.access import ROLES, Role, local_caller, network_caller
from gatewayd.core.forcing import Holder


def test_a_greater_role_may_do_what_a_lesser_one_may() -> None:
    assert Role.VIEWER < Role.OPERATOR < Role.ENGINEER
    assert list(ROLES) == ["viewer", "operator", "engineer"]


def test_a_user_of_this_machine_may_do_everything() -> None:
    caller = local_caller("anna")
    assert (caller.role, caller.detail, caller.holder.title) == (Role.ENGINEER, "by anna", "anna")
    assert caller.holder.credential == ""


def test_a_token_of_the_same_name_is_another_one() -> None:
    caller = network_caller(Role.VIEWER, Holder("anna", "key"), "192.0.2.7", 5.0)
    assert caller.detail == "by token anna from 192.0.2.7"
    assert caller.holder.title == "token anna"
    assert caller.holder != local_caller("anna").holder
