"""The package and its service under a real systemd as PID 1, in one boot of user-mode-linux: scenario.py acts, and
what it saw is judged here."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from gatewayd import __version__
from tests.e2e.processes import wait_for
from tests.systemd import machine
from tests.systemd.machine import NEXT

Facts = dict[str, Any]

pytestmark = [
    pytest.mark.timeout(480),  # whoever comes second waits for the boot
    pytest.mark.skipif(bool(machine.missing()), reason=f"no machine to boot: {machine.missing()}"),
]


@pytest.fixture(scope="session")
def steps(package: Path, shared: Path) -> Facts:
    """What each step saw."""
    if any(character.isspace() for character in str(shared)):
        pytest.skip("the kernel's command line takes no path with a space")
    assert package.exists()
    wait_for((shared / machine.ENDED).exists, "the machine to end", machine.LIMIT + 30)
    results = shared / "results"
    try:
        found: Facts = json.loads((results / "steps.json").read_text())
    except FileNotFoundError:
        pytest.fail(_story(shared))
    for name, facts in found.items():
        assert "defect" not in facts, f"{name}: {facts['defect']}\n{_story(shared)}"
    assert "purge" in found, _story(shared)
    return found


def _story(shared: Path) -> str:
    logs = [
        shared / "machine.log",
        *(shared / f"results/{name}.log" for name in ("init", "kernel", "scenario")),
    ]
    found = [path for path in logs if path.exists()]
    return "\n".join(f"{path.name}:\n{path.read_text(errors='replace')[-2000:]}" for path in found)


def is_running(state: dict[str, str]) -> bool:
    return (state["ActiveState"], state["SubState"]) == ("active", "running")


def test_installing_starts_nothing(steps: Facts) -> None:
    seen = steps["install"]
    assert seen["code"] == 0, seen["said"]
    assert seen["version"] == f"gatewayd {__version__}"
    assert (seen["state"]["ActiveState"], seen["state"]["UnitFileState"]) == ("inactive", "disabled")
    assert (seen["shell"], seen["is_system_user"]) == ("/usr/sbin/nologin", True)
    assert seen["mappings"] == "0o750 root:gatewayd"
    assert seen["verify"] == ""


def test_without_a_mapping_it_stays_out_of_the_way(steps: Facts) -> None:
    seen = steps["start_without_mapping"]
    assert seen["code"] == 0
    assert (seen["state"]["ActiveState"], seen["state"]["ConditionResult"]) == ("inactive", "no")


def test_start_returns_when_it_serves_and_the_status_is_a_sentence(steps: Facts) -> None:
    seen = steps["start"]
    assert seen["code"] == 0, seen["said"]
    assert is_running(seen["first"])
    assert seen["fresh"]
    assert seen["state"]["StatusText"].startswith("press-3: robot fresh")
    assert seen["version_of_status_block"] == 1, "a PLC reads from port 502"


def test_it_is_nobody_with_one_capability(steps: Facts) -> None:
    seen = steps["start"]
    bind_service = 1 << 10
    assert (seen["user"], seen["capabilities"], seen["bounding"]) == ("gatewayd", bind_service, bind_service)
    assert (seen["no_new_privileges"], seen["seccomp"]) == ("1", "2")


def test_the_journal_has_priority_unit_and_name(steps: Facts) -> None:
    seen = steps["journal_fields"]
    assert seen["units"] == ["gatewayd.service"]
    lines = seen["lines"]
    assert lines["listening for Modbus listen=127.0.0.1:502"] == "6"
    assert [text for text, priority in lines.items() if priority == "4" and text.startswith("writer lost")]
    assert not [text for text in lines if text.startswith("<")], "the priority is no part of the text"


def test_the_control_socket_is_for_root_and_the_group(steps: Facts) -> None:
    seen = steps["control"]
    degraded = 1  # no PLC is connected
    assert (seen["root"]["code"], seen["member"]["code"]) == (degraded, degraded), seen
    assert "press-3" in seen["root"]["said"]
    assert "press-3" in seen["member"]["said"]
    assert seen["stranger"]["code"] != 0
    assert "press-3" not in seen["stranger"]["said"] + seen["lists"]["said"]
    assert seen["lists"]["said"].count("Permission denied") == 3, seen["lists"]
    assert "/run/gatewayd 750 gatewayd:gatewayd" in seen["modes"]


def test_what_it_may_do_and_what_not(steps: Facts) -> None:
    (line,) = [line for line in steps["confinement"]["said"].splitlines() if line.startswith("{")]
    seen = json.loads(line)
    assert seen.pop("user") != 0
    allowed = {name for name, result in seen.items() if result == "done"}
    assert allowed == {"can", "netlink socket", "write state", "write /tmp", "read mapping"}
    assert seen["other processes"] == []
    assert seen["write /etc"] == seen["write /usr"] == "EROFS"
    assert seen["packet socket"] == "EAFNOSUPPORT"
    assert seen["connect to this machine"] == "ECONNREFUSED"
    assert seen["connect to the internet"] != "ECONNREFUSED", "the address list lets packets out"


def test_a_reload_keeps_the_process(steps: Facts) -> None:
    seen = steps["reload"]
    assert seen["code"] == 0, seen["said"]
    assert seen["settled"]
    assert seen["fresh"]
    assert is_running(seen["after"])
    assert seen["after"]["MainPID"] == seen["before"]["MainPID"]
    assert seen["variables"] == 3, "the new mapping is served"


def test_a_reload_with_a_mistake_fails_and_the_old_mapping_runs_on(steps: Facts) -> None:
    seen = steps["reload_with_a_mistake"]
    assert seen["code"] != 0
    assert is_running(seen["after"])
    assert seen["after"]["MainPID"] == seen["before"]["MainPID"]
    assert seen["version_of_status_block"] == 1


def test_a_reload_that_is_refused_fails_and_says_why(steps: Facts) -> None:
    """What only the running gateway can know ends in systemctl's exit code too."""
    seen = steps["reload_that_is_unsafe"]
    assert seen["checked"] == 0
    assert seen["code"] != 0
    assert "reload refused" in seen["after"]["StatusText"]
    assert is_running(seen["after"])
    assert seen["after"]["MainPID"] == seen["before"]["MainPID"]


def test_a_reload_by_signal_for_those_without_control_socket(steps: Facts) -> None:
    seen = steps["reload_without_control_socket"]
    assert seen["code"] == 0, seen["said"]
    assert seen["told"]
    assert is_running(seen["after"])


def test_a_bare_signal_leaves_the_reason_in_the_status(steps: Facts) -> None:
    seen = steps["reload_with_a_mistake"]
    assert seen["told"]
    assert is_running(seen["after_a_bare_signal"])
    assert seen["after_a_bare_signal"]["MainPID"] == seen["before"]["MainPID"]


def test_the_watchdog_ends_a_frozen_process_and_it_serves_again(steps: Facts) -> None:
    seen = steps["freeze"]
    assert seen["restarted"]
    assert seen["active"]
    assert seen["noticed"] < 8
    assert seen["after"]["MainPID"] != seen["before"]["MainPID"]
    assert [line for line in seen["journal"] if "Watchdog timeout" in line]


def test_a_crash_is_followed_by_a_restart(steps: Facts) -> None:
    assert steps["crash"]["active"]
    assert steps["crash"]["after"]["MainPID"] != steps["crash"]["before"]["MainPID"]


def test_an_upgrade_restarts_what_runs_and_keeps_settings(steps: Facts) -> None:
    seen = steps["upgrade"]
    assert seen["code"] == 0, seen["said"]
    assert seen["package"] == NEXT
    assert is_running(seen["after"])
    assert seen["after"]["MainPID"] != seen["before"]["MainPID"]
    assert seen["fresh"]
    assert seen["setting"] == "# mine\n"
    assert seen["mapping"]


def test_another_python_means_another_environment_and_a_restart(steps: Facts) -> None:
    seen = steps["another_python"]
    assert seen["code"] == 0, seen["said"]
    assert seen["right"], "the link names the environment of the system's Python"
    assert len(seen["environments"]) == 1, "the former one is gone"
    assert is_running(seen["after"])
    assert seen["after"]["MainPID"] != seen["before"]["MainPID"]
    assert seen["fresh"]


def test_a_new_package_of_the_same_python_disturbs_nobody(steps: Facts) -> None:
    seen = steps["another_python"]["unchanged"]
    assert seen["code"] == 0, seen["said"]
    assert seen["after"]["MainPID"] == steps["another_python"]["before"]["MainPID"]


def test_an_upgrade_leaves_a_cell_alone_that_it_would_not_serve(steps: Facts) -> None:
    seen = steps["configure_with_a_mistake"]
    assert seen["code"] == 0, seen["said"]
    assert "NOT restarted" in seen["said"]
    assert seen["after"]["MainPID"] == seen["before"]["MainPID"]


def test_steps_of_the_wall_clock_by_years_matter_to_nobody(steps: Facts) -> None:
    seen = steps["wall_clock"]
    for moment in seen["seen"]:
        assert moment["fresh"]
        assert moment["robot fresh"]
        assert is_running(moment["state"])
        assert moment["state"]["MainPID"] == seen["before"]["MainPID"]
    assert seen["gaps"] == 0


def test_mappings_come_by_git_through_another_user(steps: Facts) -> None:
    seen = steps["mappings_by_git"]
    assert seen["first"]["code"] == 0, seen
    assert "/var/lib/gatewayd-mappings 750 gatewayd-mappings:gatewayd" in seen["modes"]
    assert "press-3.yaml 640 gatewayd-mappings:gatewayd" in seen["modes"]
    assert seen["touched"] != 0, "the gateway cannot change its mapping"
    assert is_running(seen["gateway"])
    assert "/var/lib/gatewayd-mappings/current" in seen["command"]
    assert seen["timer"]["code"] == 0, seen["timer"]


def test_a_bad_mapping_from_git_fails_visibly_and_displaces_nothing(steps: Facts) -> None:
    seen = steps["mappings_by_git"]
    assert seen["bad"]["code"] != 0
    assert seen["state"]["ActiveState"] == "failed"
    assert "GW102" in seen["journal"]
    assert "what runs goes on" in seen["journal"]
    assert "gatewayd_mappings_ok 0" in seen["metrics"]


def test_an_upgrade_checks_the_mappings_that_the_service_reads(steps: Facts) -> None:
    """Not /etc/gatewayd, where a drop-in names another directory."""
    assert steps["mappings_by_git"]["checked by an upgrade"] == "/var/lib/gatewayd-mappings/current"


def test_a_stop_is_orderly(steps: Facts) -> None:
    seen = steps["stop"]
    assert seen["code"] == 0
    assert (seen["after"]["ActiveState"], seen["after"]["Result"]) == ("inactive", "success")
    assert seen["seconds"] < 4
    assert "stopped" in seen["said"]


def test_a_mistake_at_the_start_fails_for_good_and_says_where(steps: Facts) -> None:
    seen = steps["start_with_a_mistake"]
    assert seen["code"] != 0
    assert (seen["after"]["ActiveState"], seen["after"]["NRestarts"]) == ("failed", "0")
    assert [line for line in seen["said"] if "GW102" in line and "press-3.yaml:9:3" in line]


def test_one_cell_by_the_template(steps: Facts) -> None:
    seen = steps["one_cell"]
    assert seen["code"] == 0, seen["said"]
    assert is_running(seen["state"])
    assert seen["missing"]["code"] != 0, "a cell without a mapping is a mistake"


def test_removing_stops_it_and_leaves_what_people_wrote(steps: Facts) -> None:
    seen = steps["remove"]
    assert seen["code"] == 0, seen["said"]
    assert seen["after"]["ActiveState"] == "inactive"
    assert not seen["program"]
    assert (seen["mapping"], seen["setting"], seen["state"]) == (True, True, True)


def test_purging_leaves_the_mappings_alone(steps: Facts) -> None:
    seen = steps["purge"]
    assert seen["code"] == 0, seen["said"]
    assert (seen["mapping"], seen["setting"], seen["state"]) == (True, False, False)
    assert seen["known"] == ""
