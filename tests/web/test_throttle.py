from __future__ import annotations

from gatewayd.web.throttle import FIRST_DELAY, FORGET_AFTER, MAX_DELAY, MAX_PEERS, WrongTokens


def test_each_wrong_token_waits_twice_as_long_as_the_last() -> None:
    wrong = WrongTokens()
    delays = [wrong.wrong("192.0.2.7", float(number))[1] for number in range(10)]
    assert delays[:4] == [FIRST_DELAY, 2 * FIRST_DELAY, 4 * FIRST_DELAY, 8 * FIRST_DELAY]
    assert delays[-1] == MAX_DELAY


def test_each_peer_for_itself_and_not_for_ever() -> None:
    wrong = WrongTokens()
    assert [wrong.wrong("192.0.2.7", 0.0)[0] for _ in range(3)] == [1, 2, 3]
    assert wrong.wrong("192.0.2.8", 0.0) == (1, FIRST_DELAY)
    assert wrong.wrong("192.0.2.7", FORGET_AFTER - 1) == (4, 8 * FIRST_DELAY)
    assert wrong.wrong("192.0.2.7", 3 * FORGET_AFTER) == (1, FIRST_DELAY)


def test_a_machine_has_a_whole_network_of_ipv6() -> None:
    wrong = WrongTokens()
    assert wrong.wrong("2001:db8::1", 0.0)[0] == 1
    assert wrong.wrong("2001:db8::2", 0.0)[0] == 2
    assert wrong.wrong("2001:db8:0:1::2", 0.0)[0] == 1
    assert wrong.wrong("::ffff:192.0.2.7", 0.0)[0] == 1
    assert wrong.wrong("::ffff:192.0.2.8", 0.0)[0] == 1
    assert wrong.wrong("control socket", 0.0)[0] == 1


def test_memory_is_bounded_and_the_quietest_goes() -> None:
    wrong = WrongTokens()
    wrong.wrong("192.0.2.7", 0.0)
    for number in range(MAX_PEERS):
        wrong.wrong(f"2001:db8:{number:x}::1", 1.0)
    assert len(wrong) == MAX_PEERS
    assert wrong.wrong("192.0.2.7", 2.0)[0] == 1
