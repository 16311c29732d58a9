"""The units as systemd reads them: no mistake, and little that the gateway may do."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

SYSTEMD = Path(__file__).parents[2] / "systemd"
UNITS = ("gatewayd.service", "gatewayd@.service")
MOST_EXPOSURE = 1.7
"""Of 10, with port 502."""

needs_systemd = pytest.mark.skipif(
    shutil.which("systemd-analyze") is None, reason="systemd-analyze is missing (apt-get install systemd)"
)


def settings(path: Path) -> dict[str, dict[str, list[str]]]:
    """Section -> key -> its values in their order."""
    found: dict[str, dict[str, list[str]]] = {}
    section = ""
    for line in path.read_text().splitlines():
        if line.startswith("["):
            section = line.strip("[]")
        elif line and not line.startswith("#"):
            key, _, value = line.partition("=")
            found.setdefault(section, {}).setdefault(key, []).append(value)
    return found


def tree(target: Path, *drop_ins: str) -> Path:
    """The units with a program that exists, and drop-ins."""
    for unit in UNITS:
        text = (SYSTEMD / unit).read_text().replace("/usr/bin/gatewayd", shutil.which("true") or "/bin/true")
        (target / unit).write_text(text)
        for name in drop_ins:
            folder = target / f"{unit}.d"
            folder.mkdir(exist_ok=True)
            shutil.copy(SYSTEMD / "examples" / name, folder)
    return target


def exposure(unit: Path) -> float:
    done = subprocess.run(
        ["systemd-analyze", "security", "--offline=true", "--no-pager", unit],
        capture_output=True,
        text=True,
        check=False,
        env={"PATH": "/usr/bin:/bin", "LC_ALL": "C"},
    )
    found = re.search(r"Overall exposure level for \S+: ([\d.]+)", done.stdout)
    assert found, done.stdout + done.stderr
    return float(found[1])


@needs_systemd
@pytest.mark.parametrize(
    "drop_in",
    [
        None,
        "addresses.conf",
        "unprivileged-ports.conf",
        "reload-by-signal.conf",
        "serial-ports.conf",
        "standby.conf",
    ],
)
@pytest.mark.parametrize("unit", UNITS)
def test_systemd_finds_no_mistake(unit: str, drop_in: str | None, tmp_path: Path) -> None:
    name = unit.replace("@", "@press-3")
    tree(tmp_path, *filter(None, [drop_in]))
    done = subprocess.run(
        ["systemd-analyze", "verify", "--man=no", tmp_path / name],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")


@needs_systemd
@pytest.mark.parametrize("unit", UNITS)
def test_exposure_with_port_502(unit: str, tmp_path: Path) -> None:
    assert exposure(tree(tmp_path) / unit) <= MOST_EXPOSURE
    assert "CAP_NET_BIND_SERVICE" in (tmp_path / unit).read_text()


@needs_systemd
def test_exposure_is_less_without_it(tmp_path: Path) -> None:
    assert exposure(tree(tmp_path, "unprivileged-ports.conf") / UNITS[0]) <= MOST_EXPOSURE - 0.3


@needs_systemd
def test_the_address_list_costs_nothing(tmp_path: Path) -> None:
    assert exposure(tree(tmp_path, "addresses.conf") / UNITS[0]) <= MOST_EXPOSURE


@needs_systemd
def test_serial_ports_cost_little(tmp_path: Path) -> None:
    """Docs say how much."""
    assert exposure(tree(tmp_path, "serial-ports.conf") / UNITS[0]) <= MOST_EXPOSURE + 0.3


MAPPINGS_BY_GIT = ("gatewayd-mappings.service", "gatewayd-mappings.timer")


def mappings_by_git(target: Path) -> Path:
    """The units that fetch mappings, and the gateway's with the drop-in; programs that exist."""
    exists = shutil.which("true") or "/bin/true"
    for name in MAPPINGS_BY_GIT:
        text = (SYSTEMD / "examples" / name).read_text()
        (target / name).write_text(text.replace("/usr/local/sbin/gatewayd-mappings", exists))
    tree(target, "mappings-by-git.conf")
    drop_in = target / "gatewayd.service.d/mappings-by-git.conf"
    drop_in.write_text(drop_in.read_text().replace("/usr/bin/gatewayd", exists))
    return target


@needs_systemd
@pytest.mark.parametrize("unit", [*MAPPINGS_BY_GIT, "gatewayd.service"])
def test_systemd_finds_no_mistake_in_the_units_that_fetch_mappings(unit: str, tmp_path: Path) -> None:
    done = subprocess.run(
        ["systemd-analyze", "verify", "--man=no", mappings_by_git(tmp_path) / unit],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")


@needs_systemd
def test_exposure_of_what_fetches_mappings(tmp_path: Path) -> None:
    """It has no address list: where the git server is the plant knows."""
    assert exposure(mappings_by_git(tmp_path) / "gatewayd-mappings.service") <= MOST_EXPOSURE


def test_the_template_differs_in_what_it_must() -> None:
    """Two files say the same, so a change of one is a change of both."""
    one, template = (settings(SYSTEMD / unit) for unit in UNITS)
    different = {
        key
        for section in one.keys() | template.keys()
        for key in one[section].keys() | template[section].keys()
        if one[section].get(key) != template[section].get(key)
    }
    assert different == {
        "AssertPathExists",
        "ConditionPathExistsGlob",
        "Description",
        "EnvironmentFile",
        "ExecStart",
        "ExecStartPre",
        "RuntimeDirectory",
        "StateDirectory",
    }


def test_the_service_restarts_without_limit() -> None:
    unit = settings(SYSTEMD / UNITS[0])
    assert unit["Unit"]["StartLimitIntervalSec"] == ["0"]
    service = unit["Service"]
    assert (service["Type"], service["WatchdogSec"], service["Restart"]) == (
        ["notify"],
        ["2s"],
        ["on-failure"],
    )
    assert service["RestartSec"] == ["250ms"]


@pytest.mark.skipif(shutil.which("systemd-sysusers") is None, reason="systemd-sysusers is missing")
def test_the_user_is_made_without_a_shell(tmp_path: Path) -> None:
    (tmp_path / "etc").mkdir()
    done = subprocess.run(
        ["systemd-sysusers", f"--root={tmp_path}", SYSTEMD / "gatewayd.sysusers"],
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        pytest.skip(f"systemd-sysusers may not work here: {done.stderr.strip()}")
    (line,) = (tmp_path / "etc/passwd").read_text().splitlines()
    assert re.fullmatch(
        r"gatewayd:[^:]*:\d+:\d+:gatewayd fieldbus gateway:/var/lib/gatewayd:/usr/sbin/nologin", line
    )


def test_the_can_sample_has_bit_rate_and_restart() -> None:
    sample = settings(SYSTEMD / "can0.network")
    assert sample["Match"]["Name"] == ["can0"]
    assert sample["CAN"]["BitRate"] == ["500K"]
    assert sample["CAN"]["RestartSec"] == ["100ms"]


@pytest.mark.parametrize("unit", UNITS)
def test_a_service_may_use_every_kind_of_socket_that_the_gateway_opens(unit: str) -> None:
    """SocketCAN asks the kernel over netlink how its interface is, and refuses to open without."""
    ((families,),) = [settings(SYSTEMD / unit)["Service"]["RestrictAddressFamilies"]]
    opened = {
        family
        for path in (SYSTEMD.parent / "gatewayd").rglob("*.py")
        for family in re.findall(r"\bsocket\.(AF_(?:CAN|NETLINK|UNIX|PACKET))\b", path.read_text())
    }
    assert opened >= {"AF_NETLINK"}
    assert opened <= set(families.split())
