"""What is too long without data."""

from __future__ import annotations

from gatewayd.rtde.session import ClientSettings
from gatewayd.rtde.silence import Silence
from gatewayd.rtde.strange import Oddity, StrangePackage


def test_the_first_package_has_more_time_than_those_after_it() -> None:
    silence = Silence(ClientSettings(host="robot", first_data_timeout=30.0, data_timeout=1.0))
    silence.heard = 100.0
    silence.expect(0.002)
    assert silence.exceeded(129.0) is None
    assert silence.exceeded(131.0) == 31.0
    before = silence.regular
    silence.data(129.0)
    assert (before, silence.regular) == (False, True)
    assert silence.exceeded(129.9) is None
    assert silence.exceeded(130.5) == 1.5
    silence.expect(2.0)
    silence.data(200.0)
    assert silence.exceeded(209.0) is None, "five periods"


def test_what_came_instead_is_said_until_data_comes() -> None:
    silence = Silence(ClientSettings(host="robot"))
    assert silence.instead("") == ""
    silence.odd = StrangePackage(Oddity.UNKNOWN_TYPE, 7, "unknown package type 7", b"")
    assert not silence.regular
    assert "it sent" in silence.instead("")
    assert silence.instead("5 of 8 bytes") == "; what it sent stops at 5 of 8 bytes"
    silence.data(1.0)
    assert silence.instead("") == ""
