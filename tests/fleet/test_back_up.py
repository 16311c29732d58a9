"""docs/howto/back-up.md: its commands make a copy from which another machine is the same gateway."""

from __future__ import annotations

import json
import re
import shutil
import subprocess

from tests.e2e.can_plant import start_bus, start_master
from tests.e2e.plant import Plant
from tests.e2e.plc import PLC
from tests.e2e.processes import HOST, Daemon, wait_for
from tests.e2e.test_canopen import OPERATIONAL, PRE_OPERATIONAL, SMALL
from tests.fleet.site import REAL_GATEWAYD, ROOT

GUIDE = (ROOT / "docs/howto/back-up.md").read_text()
SAVE = 0x6576_6173
HEARTBEAT = 0x1017


class Machine:
    """A file system of its own for what a gateway has, and the guide's commands in it."""

    def __init__(self, plant: Plant, name: str) -> None:
        self.plant, self.root = plant, plant.directory / name
        self.bin, self.backups = plant.directory / f"{name}-bin", plant.directory / "backups"
        for path in ("etc/gatewayd", "etc/default", "etc/systemd/system", "var/lib/gatewayd"):
            (self.root / path).mkdir(parents=True)
        self.bin.mkdir()
        self.backups.mkdir(exist_ok=True)
        for program, text in (("gatewayd", REAL_GATEWAYD), ("systemctl", "#!/bin/sh\n")):
            (self.bin / program).write_text(text)
            (self.bin / program).chmod(0o755)
        self.socket = plant.directory / f"{name}.sock"

    def start(self) -> Daemon:
        state = self.root / "var/lib/gatewayd"
        options = ("--control", self.socket, "--state", state, "--audit", state / "audit.jsonl")
        daemon = self.plant.daemon(self.root / "etc/gatewayd", *options)
        wait_for(self.socket.exists, "the control socket")
        return daemon

    def carry_out(self, commands: str) -> str:
        """As the guide has them, but for this root; what they print."""
        text = commands.replace("cd /\n", f"cd {self.root}\n").replace("/var/backups", str(self.backups))
        done = subprocess.run(
            ["sh", "-e", "-c", text.replace(" /etc/gatewayd", f" {self.root}/etc/gatewayd")],
            env={"PATH": f"{self.bin}:/usr/bin:/bin", "GATEWAYD_CONTROL": str(self.socket)},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout


def commands(heading: str) -> str:
    """The block below a heading."""
    found = re.search(rf"^## {heading}\n.*?^```sh\n(.*?)^```", GUIDE, re.MULTILINE | re.DOTALL)
    assert found
    return found[1]


def test_another_machine_is_the_same_gateway(plant: Plant) -> None:
    """Fingerprint, stored parameters, settings and audit; nobody owns anything, and nothing is forced."""
    _bus, port = start_bus(plant)
    simulator = plant.simulator()
    old, new = Machine(plant, "old"), Machine(plant, "new")
    mapping = plant.mapping(SMALL.format(port=port), simulator.port)
    master = start_master(plant, mapping, "slcan", f"socket://{HOST}:{port}")
    master.ask("beat", True)
    shutil.copy(mapping, old.root / "etc/gatewayd/cell.yaml")
    (old.root / "etc/default/gatewayd").write_text("GATEWAYD_STATUS=127.0.0.1:9502\n")
    (old.root / "etc/systemd/system/gatewayd.service.d").mkdir()
    (old.root / "etc/systemd/system/gatewayd.service.d/addresses.conf").write_text("[Service]\n")
    (old.root / "etc/gatewayd/key.pem").write_text("secret\n")
    (old.root / "etc/gatewayd/key.pem").chmod(0o640)
    daemon = old.start()
    master.becomes(OPERATIONAL)
    master.ask("nmt", "PRE-OPERATIONAL")
    master.becomes(PRE_OPERATIONAL)
    assert master.ask("write", HEARTBEAT, 0, 250) is None
    assert master.ask("write", 0x1010, 1, SAVE) is None
    assert plant.ready_plc(PLC).write_integers(0, 7) == 0
    wait_for(lambda: "command" in (old.root / "var/lib/gatewayd/audit.jsonl").read_text(), "the audit")
    subprocess.run(
        [old.bin / "gatewayd", "force", "setpoint", "3", "--socket", old.socket, "--for", "60s"], check=True
    )

    old.carry_out(commands("Back up"))
    archive = old.backups / "gatewayd.tar.gz"
    assert archive.stat().st_mode & 0o077 == 0, "keys are in it"
    daemon.kill()
    shutil.rmtree(old.root)
    script = commands("Restore")
    before, after = script.split("gatewayd status")
    assert "no error" not in new.carry_out(before)
    new.start()
    assert new.carry_out(f"gatewayd status{after}") == "the same mappings\n"

    assert (new.root / "etc/gatewayd/key.pem").stat().st_mode & 0o777 == 0o640
    assert (new.root / "etc/systemd/system/gatewayd.service.d/addresses.conf").exists()
    assert "GATEWAYD_STATUS" in (new.root / "etc/default/gatewayd").read_text()
    master.becomes(OPERATIONAL)
    assert master.ask("read", HEARTBEAT, 0) == 250
    assert '"command"' in (new.root / "var/lib/gatewayd/audit.jsonl").read_text()
    status = subprocess.run(
        [new.bin / "gatewayd", "status", "--json", "--socket", new.socket], capture_output=True, check=False
    )
    (cell,) = json.loads(status.stdout)["cells"]
    assert "forced" not in json.dumps(cell["problems"])
    assert plant.ready_plc(PLC).owner(1) == 0


def test_every_place_of_the_table_is_in_the_archive() -> None:
    """A place that the guide names below /etc or /var is one that its first command looks at."""
    table = GUIDE.split("## Back up")[0]
    looked_at = re.findall(r"(?:etc|var)/\S+", commands("Back up").split("-maxdepth")[0])
    kept = table.split("Not in it")[0]
    for place in re.findall(r"`/((?:etc|var)/[^`]+)`", kept):
        assert any(f"{place}/".startswith(known.rstrip("*")) for known in looked_at), place


def test_a_backup_without_optional_parts_succeeds(plant: Plant) -> None:
    """Nothing but a mapping: no settings, no drop-ins."""
    machine = Machine(plant, "bare")
    (machine.root / "etc/gatewayd/cell.yaml").write_text("gatewayd: 1\n")
    backup = commands("Back up").split("gatewayd status")[0]
    machine.carry_out(backup)
    listed = subprocess.run(
        ["tar", "--list", f"--file={machine.backups / 'gatewayd.tar.gz'}"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert "etc/gatewayd/cell.yaml" in listed.stdout.split()
