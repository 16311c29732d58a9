from __future__ import annotations

import pytest
from click import BadParameter

from gatewayd.cli.rtde.target import TARGET


@pytest.mark.parametrize(
    "text, target",
    [
        ("192.0.2.10", ("192.0.2.10", 30004)),
        ("robot.local:30104", ("robot.local", 30104)),
        ("::1", ("::1", 30004)),
        ("[::1]", ("::1", 30004)),
        ("[fe80::1%eth0]:7", ("fe80::1%eth0", 7)),
        ("fe80::1%eth0", ("fe80::1%eth0", 30004)),
    ],
)
def test_host_and_port(text: str, target: tuple[str, int]) -> None:
    assert TARGET.convert(text, None, None) == target
    assert TARGET.convert(target, None, None) == target


@pytest.mark.parametrize(
    "text", ["", "robot:", "robot:0", "robot:65536", "http://robot", "two words", "[::1"]
)
def test_anything_else_is_refused_with_what_was_expected(text: str) -> None:
    with pytest.raises(BadParameter, match=r"is not HOST or HOST:PORT, say 192\.0\.2\.10"):
        TARGET.convert(text, None, None)
