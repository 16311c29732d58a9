"""systemd/examples/gatewayd-mappings with a real repository and a running gateway: what is good is served."""

from __future__ import annotations

import shutil
import socket
import subprocess
from pathlib import Path

import pytest

from tests.e2e.plant import HEAD, Plant
from tests.e2e.plc import PLC
from tests.e2e.processes import HOST, Daemon, free_port, wait_for
from tests.fleet.site import SCRIPT, Site, needs_git

pytestmark = needs_git

CELL = f"""\
writers: {{plc: {{modbus: {PLC}}}}}
variables:
  part:   {{robot: input_int_register_0, modbus: 0, owner: plc, limits: [0, 100]}}
  cycles: {{robot: output_int_register_0, modbus: 100}}
"""
MORE = CELL + "  level:  {robot: output_double_register_0, modbus: 104}\n"
WIDER = MORE.replace("[0, 100]", "[0, 1000]")


class Served:
    """A gateway that serves what the script has put into place."""

    def __init__(self, plant: Plant) -> None:
        self.plant, self.site = plant, Site(plant.directory)
        self.robot = plant.simulator()

    def text(self, cell: str, *, name: str = "press", modbus: int = 0) -> str:
        return (
            HEAD.format(
                name=name,
                host=HOST,
                robot=self.robot.port,
                frequency=25,
                stale_after="1s",
                robot_options="",
                modbus=modbus or self.plant.modbus,
                unit=1,
                modbus_options="",
            )
            + cell
        )

    def start(self, mapping: Path | None = None) -> None:
        """A gateway, with a control socket; one that ran before has ended."""
        self.site.socket.unlink(missing_ok=True)
        self.daemon: Daemon = self.plant.daemon(mapping or self.site.current, "--control", self.site.socket)
        wait_for(self.site.socket.exists, "the control socket")


@pytest.fixture
def served(plant: Plant) -> Served:
    """With its first mapping in place and running."""
    found = Served(plant)
    found.site.commit({"press.yaml": found.text(CELL)})
    assert "in place for the first start" in found.site.served()
    found.start()
    return found


@pytest.mark.skipif(shutil.which("shellcheck") is None, reason="shellcheck is missing")
def test_the_script_is_in_order() -> None:
    done = subprocess.run(["shellcheck", SCRIPT], capture_output=True, text=True, check=False)
    assert done.stdout == ""


def test_a_change_is_served_and_told(served: Served) -> None:
    site = served.site
    commit = site.commit({"press.yaml": served.text(MORE)})
    said = site.served()
    assert "reloaded in" in said
    assert f"commit {commit}, wanted: press " in said
    assert len(served.plant.plc().doubles(104)) == 1
    figures = site.figures()
    assert figures["gatewayd_mappings_ok"] == 1
    (wanted,) = [name for name in figures if name.startswith("gatewayd_mappings_wanted_info")]
    assert wanted.split('"')[3] in said.split("running: ")[1]

    # A commit that changes other machines' files changes nothing here.
    (site.work / "cells/weld").mkdir()
    (site.work / "cells/weld/weld.yaml").write_text("anything")
    other = site.commit({})
    assert "reloaded" not in (said := site.served())
    assert f"commit {other}" in said
    assert (site.state / "served").read_text().strip() == other


def test_a_file_with_errors_is_never_in_place(served: Served) -> None:
    site = served.site
    before = site.files()
    site.commit({"press.yaml": served.text(MORE), "weld.yaml": "gatewayd: 1\ncell: weld\n"})
    said = site.refused()
    assert "GW" in said
    assert "what runs goes on" in said
    assert site.files() == before
    assert site.figures()["gatewayd_mappings_ok"] == 0
    assert any(name.startswith("gatewayd_mappings_wanted_info") for name in site.figures())
    assert len(served.daemon.lines("reload asked for")) == 1, "only for the version before"
    site.git("rm", "--quiet", "cells/press/weld.yaml")
    site.commit({})
    assert "reloaded in" in site.served(), "the next commit is tried anew"


def test_a_refused_reload_puts_the_old_files_back_until_somebody_consents(served: Served) -> None:
    site = served.site
    before = site.files()
    site.commit({"press.yaml": served.text(WIDER)})
    said = site.refused()
    assert "--accept weakening" in said
    assert site.files() == before
    assert not (site.state / "pending").exists()
    served.daemon.kill()
    served.start()
    assert served.plant.ready_plc(PLC).write_integers(0, 500) != 0, "a restart serves what was served"
    assert "reloaded in" in site.served("--accept", "weakening")
    assert served.plant.ready_plc(PLC).write_integers(0, 500) == 0


def test_the_author_of_a_change_may_consent_for_all_machines(served: Served) -> None:
    site = served.site
    site.commit({"press.yaml": served.text(WIDER)}, "Widen\n\nGatewayd-Accept: weakening, release; --force")
    site.commit({"README": "not a mapping"}, "Nothing")
    assert "reloaded in" in site.served()


def test_what_the_gateway_cannot_do_is_put_back_too(served: Served) -> None:
    site = served.site
    before, taken = site.files(), free_port()
    with socket.create_server((HOST, taken)):
        site.commit({"press.yaml": served.text(CELL, modbus=taken)})
        assert "failed, the old mapping runs on" in site.refused()
    assert site.files() == before
    assert "reloaded in" in site.served(), "the port is free now"


def test_back_to_the_version_before_lasts_until_there_is_a_newer_one(served: Served) -> None:
    site = served.site
    assert "no version to go back to" in site.refused("back")
    first = site.files()
    site.commit({"press.yaml": served.text(MORE)})
    site.served()
    assert "--accept gone" in site.refused("back"), "a third of the variables"
    assert site.files() != first
    site.served("back", "--accept", "gone")
    assert site.files() == first
    assert "waiting for a newer one" in site.refused()
    assert site.files() == first
    site.commit({"press.yaml": served.text(MORE.replace("level", "height"))})
    site.served()
    assert "height" in site.files()["press.yaml"]


def test_a_gateway_that_was_away_gets_it_later(served: Served) -> None:
    site = served.site
    site.served()
    served.daemon.stop()
    site.commit({"press.yaml": served.text(MORE)})
    assert "running: nothing" in (said := site.refused())
    assert "not loaded" in said
    served.start()
    assert "reloaded" not in site.served()
    assert len(served.plant.plc().doubles(104)) == 1


def test_a_gateway_that_reads_something_else_is_noticed(served: Served) -> None:
    """The drop-in was forgotten: the reload succeeds, and changes nothing."""
    site = served.site
    served.daemon.stop()
    other = served.plant.directory / "other.yaml"
    other.write_text(served.text(CELL, name="other"))
    served.start(other)
    site.commit({"press.yaml": served.text(MORE)})
    assert "does the gateway read" in site.refused()
