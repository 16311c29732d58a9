from __future__ import annotations

from pathlib import Path

from gatewayd.machine.privileges import NET_BIND_SERVICE, first_unprivileged_port, has_capability


def test_the_sysctl_says_where_ports_are_free(tmp_path: Path) -> None:
    setting = tmp_path / "start"
    setting.write_text("502\n")
    assert first_unprivileged_port(setting) == 502
    setting.write_text("?\n")
    assert first_unprivileged_port(setting) == 1024
    assert first_unprivileged_port(tmp_path / "none") == 1024
    assert 0 <= first_unprivileged_port() <= 65535


def test_a_capability_is_a_bit_of_the_status(tmp_path: Path) -> None:
    status = tmp_path / "status"
    status.write_text("Name:\tpython\nCapInh:\t0000000000000000\nCapEff:\t0000000000000400\n")
    assert has_capability(NET_BIND_SERVICE, status)
    assert not has_capability(NET_BIND_SERVICE + 1, status)
    status.write_text("Name:\tpython\n")
    assert not has_capability(NET_BIND_SERVICE, status)
    assert not has_capability(NET_BIND_SERVICE, tmp_path / "none")
