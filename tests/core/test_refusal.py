from __future__ import annotations

from gatewayd.core.refusal import PRECEDENCE, Reason


def test_the_numbers_of_the_status_block_stay() -> None:
    assert [(reason.name, reason.value) for reason in Reason] == [
        ("NO_SUCH_ADDRESS", 1),
        ("NOT_WRITABLE", 2),
        ("HELD", 3),
        ("OUT_OF_LIMITS", 4),
        ("PARTIAL_VALUE", 5),
        ("ROBOT_LOST", 6),
        ("CLAIMED_ELSEWHERE", 7),
        ("HEARTBEAT_LOST", 8),
        ("PARTIAL_TAKEOVER", 9),
        ("WAITED", 10),
        ("NOT_MEANT", 11),
        ("CONTRADICTED", 12),
        ("NOT_IN_ROLE", 13),
    ]


def test_every_reason_has_a_text_and_a_place_of_its_own() -> None:
    assert len({reason.text for reason in Reason}) == len(Reason)
    assert sorted(PRECEDENCE.values()) == list(range(len(Reason)))


def test_what_can_never_work_is_told_before_what_may_pass() -> None:
    never = {
        Reason.NO_SUCH_ADDRESS,
        Reason.NOT_WRITABLE,
        Reason.PARTIAL_VALUE,
        Reason.CONTRADICTED,
        Reason.OUT_OF_LIMITS,
        Reason.NOT_IN_ROLE,
    }
    assert set(sorted(Reason, key=PRECEDENCE.__getitem__)[: len(never)]) == never


def test_who_is_not_heard_is_told_so_before_what_would_leave_him_his_lease() -> None:
    assert all(PRECEDENCE[Reason.HEARTBEAT_LOST] < PRECEDENCE[reason] for reason in Reason if reason.renews)


def test_only_a_lost_robot_leaves_an_owner_its_lease() -> None:
    assert [reason for reason in Reason if reason.renews] == [Reason.ROBOT_LOST]
