"""A day in the life of an installed gateway: runs as root on the machine of machine.py, with its system's python3.

Each step writes what it saw into steps.json in the directory of the results; test_boot.py judges it.
"""

from __future__ import annotations

import json
import os
import pwd
import signal
import socket
import struct
import subprocess
import sys
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

RESULTS = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
MAPPINGS = Path("/etc/gatewayd")
MAPPING = """\
gatewayd: 1
cell: press-3
robot: {host: 127.0.0.1, frequency: 25, stale_after: 2s}
modbus: {listen: '127.0.0.1:502'}
writers: {plc: {modbus: 127.0.0.1}}
variables:
  part:   {robot: input_int_register_0, modbus: 10, owner: plc}
  cycles: {robot: output_int_register_0, modbus: 100}
"""
MORE = MAPPING + "  level:  {robot: output_double_register_0, modbus: 110}\n"
TURNED = MORE.replace("output_int_register_0", "input_int_register_1")
"""A value that the PLC reads becomes one that it writes."""
BROKEN = MAPPING + "  cycles: {robot: output_int_register_0, modbus: 100}\n"

BROKEN_OTHERWISE = MAPPING + "  other:  {robot: no_such_register, modbus: 120}\n"
"""Another mistake, so that its reason in the status is not the one that stands there already."""

DPKG = (
    "dpkg --force-unsafe-io --force-confold"
    # What the service never opens, and the manual page, whose index takes as long to renew as all the rest.
    " --path-exclude='/usr/share/doc/gatewayd/reference/*' --path-exclude='/usr/share/man/*'"
)
HOME = Path("/usr/lib/gatewayd")

Facts = dict[str, Any]
STEPS: list[Callable[[], Facts]] = []


def step(function: Callable[[], Facts]) -> Callable[[], Facts]:
    STEPS.append(function)
    return function


def sh(command: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(["/bin/sh", "-c", command], capture_output=True, text=True, check=False)


def show(unit: str = "gatewayd.service") -> dict[str, str]:
    names = (
        "ActiveState,SubState,Result,StatusText,MainPID,NRestarts,UnitFileState,ConditionResult,MemoryCurrent"
    )
    lines = sh(f"systemctl show {unit} --property={names}").stdout.splitlines()
    return dict(line.split("=", 1) for line in lines)


def wait_for(condition: Callable[[], bool], seconds: float = 15) -> bool:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.2)
    return False


def timed(command: str) -> Facts:
    began = time.monotonic()
    done = sh(command)
    return {"code": done.returncode, "seconds": time.monotonic() - began, "said": done.stdout + done.stderr}


def is_fresh() -> bool:
    return "robot fresh" in show()["StatusText"]


def registers(first: int, count: int) -> list[int]:
    """What a PLC reads from port 502."""
    with socket.create_connection(("127.0.0.1", 502), timeout=5) as plc:
        plc.sendall(struct.pack(">HHHBBHH", 1, 0, 6, 1, 3, first, count))
        answer = plc.recv(300)
    if answer[7] != 3:
        raise ValueError(f"the gateway answers {answer.hex(' ')}")
    return list(struct.unpack_from(f">{count}H", answer, 9))


def journal(since: str = "") -> list[Facts]:
    lines = sh(f"journalctl --boot --output=json --unit=gatewayd.service {since}").stdout.splitlines()
    return [json.loads(line) for line in lines]


@step
def install() -> Facts:
    """The package on a machine that never had one."""
    done = timed(f"{DPKG} --install /srv/results/gatewayd.deb")
    user = pwd.getpwnam("gatewayd")
    return {
        **done,
        "shell": user.pw_shell,
        "is_system_user": user.pw_uid < 1000,
        "mappings": oct(MAPPINGS.stat().st_mode & 0o7777) + " " + MAPPINGS.owner() + ":" + MAPPINGS.group(),
        "state": show(),
        "version": sh("gatewayd --version").stdout.strip(),
        "verify": sh("systemd-analyze verify --man=no /usr/lib/systemd/system/gatewayd.service").stderr,
    }


@step
def start_without_mapping() -> Facts:
    """Nothing is served that nobody asked for."""
    return {**timed("systemctl start gatewayd"), "state": show()}


@step
def start() -> Facts:
    """With a mapping on port 502, and a robot."""
    sh("systemd-run --unit=robot /usr/bin/gatewayd simulate --frequency 25")
    (MAPPINGS / "press-3.yaml").write_text(MAPPING)
    done = timed("systemctl start gatewayd")
    first = show()
    fresh = wait_for(is_fresh)
    state = show()
    status = Path(f"/proc/{state['MainPID']}/status").read_text()
    words = dict(line.split(":", 1) for line in status.splitlines() if ":" in line)
    return {
        **done,
        "first": first,
        "fresh": fresh,
        "state": state,
        "user": pwd.getpwuid(int(words["Uid"].split()[0])).pw_name,
        "capabilities": int(words["CapEff"], 16),
        "bounding": int(words["CapBnd"], 16),
        "no_new_privileges": words["NoNewPrivs"].strip(),
        "seccomp": words["Seccomp"].strip(),
        "version_of_status_block": registers(60000, 1)[0],
    }


@step
def journal_fields() -> Facts:
    """What the journal knows of each line."""
    found = journal()
    own = [one for one in found if one.get("SYSLOG_IDENTIFIER") == "gatewayd"]
    texts = {one["MESSAGE"]: one["PRIORITY"] for one in own if isinstance(one["MESSAGE"], str)}
    return {"lines": texts, "units": sorted({one.get("_SYSTEMD_UNIT", "") for one in own})}


@step
def control() -> Facts:
    """Who reaches the control socket: root, the group, nobody else."""
    nobody = "setpriv --reuid=nobody --regid=nogroup"
    return {
        "root": timed("gatewayd status"),
        "member": timed(f"{nobody} --groups=gatewayd gatewayd status"),
        "stranger": timed(f"{nobody} --clear-groups gatewayd status"),
        "lists": timed(f"{nobody} --clear-groups ls /run/gatewayd /etc/gatewayd /var/lib/gatewayd"),
        "modes": sh("stat -c '%n %a %U:%G' /run/gatewayd /run/gatewayd/* /var/lib/gatewayd").stdout,
    }


@step
def confinement() -> Facts:
    """What a program under the same restrictions may do: measured, not read from the unit."""
    sh("ip link add vcan0 type vcan; ip link set vcan0 up; ip address add 203.0.113.1/32 dev lo")
    unit = Path("/usr/lib/systemd/system/gatewayd.service").read_text()
    kept = [
        line
        for line in unit.splitlines()
        if not line.startswith(
            ("Exec", "Type=", "Watchdog", "Notify", "Restart", "Condition", "RuntimeDirectory=")
        )
    ]
    probe = RESULTS / "probe.py"
    probe.write_text(PROBE)
    start = "Type=oneshot\nStandardInput=file:/srv/results/probe.py\nExecStart=/usr/lib/gatewayd/env/bin/python3 -I -"
    text = "\n".join(kept).replace("[Service]", f"[Service]\n{start}")
    Path("/etc/systemd/system/probe.service").write_text(text)
    sh("systemctl daemon-reload; systemctl start probe.service")
    said = sh("journalctl --boot --output=cat --unit=probe.service --identifier=python3").stdout
    return {"said": said, "state": show("probe.service")}


PROBE = """
import ctypes, errno, json, os, socket, struct
def attempt(work):
    try:
        work()
    except TimeoutError:
        return "nothing came back"
    except OSError as error:
        return errno.errorcode.get(error.errno, str(error.errno))
    return "done"
def can():
    one, other = (socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) for _ in range(2))
    for each in (one, other):
        each.bind(("vcan0",))
        each.settimeout(2)
    one.send(struct.pack("=IB3x8s", 0x205, 1, b"A"))
    if other.recv(16)[8:9] != b"A":
        raise OSError(errno.EIO, "")
libc = ctypes.CDLL(None, use_errno=True)
def call(number, *arguments):
    if libc.syscall(number, *arguments) < 0:
        raise OSError(ctypes.get_errno(), "")
def connect(address):
    with socket.socket() as sock:
        sock.settimeout(1)
        sock.connect((address, 9))
print(json.dumps({
    "connect to this machine": attempt(lambda: connect("127.0.0.1")),
    "connect to the internet": attempt(lambda: connect("203.0.113.1")),
    "user": os.getuid(),
    "can": attempt(can),
    "write /etc": attempt(lambda: open("/etc/gatewayd/x.yaml", "w")),
    "write /usr": attempt(lambda: open("/usr/lib/gatewayd/x", "w")),
    "write state": attempt(lambda: open("/var/lib/gatewayd/x", "w").close()),
    "write /tmp": attempt(lambda: open("/tmp/x", "w").close()),
    "read mapping": attempt(lambda: open("/etc/gatewayd/press-3.yaml").close()),
    "read shadow": attempt(lambda: open("/etc/shadow").close()),
    "other processes": [name for name in os.listdir("/proc") if name == "1"],
    "packet socket": attempt(lambda: socket.socket(socket.AF_PACKET, socket.SOCK_RAW)),
    "netlink socket": attempt(lambda: socket.socket(socket.AF_NETLINK, socket.SOCK_RAW)),
    "ping socket": attempt(lambda: socket.socket(socket.AF_INET, socket.SOCK_RAW, 1)),
    "mount": attempt(lambda: call(165, b"x", b"/mnt", b"tmpfs", 0, 0)),
    "new namespace": attempt(lambda: call(272, 0x10000000)),
    "ptrace": attempt(lambda: call(101, 0, 0, 0, 0)),
    "set clock": attempt(lambda: call(227, 0, b"0" * 16)),
    "executable memory": "done" if libc.mmap(None, 4096, 7, 34, -1, 0) not in (-1,) else "EPERM",
}))
"""


@step
def reload() -> Facts:
    """A changed mapping."""
    before = show()
    (MAPPINGS / "press-3.yaml").write_text(MORE)
    done = timed("systemctl reload gatewayd")
    settled = wait_for(lambda: show()["ActiveState"] != "reloading")
    fresh = wait_for(is_fresh)
    time.sleep(0.5)
    return {
        **done,
        "before": before,
        "settled": settled,
        "fresh": fresh,
        "after": show(),
        "variables": registers(60005, 1)[0],
    }


@step
def reload_with_a_mistake() -> Facts:
    """The old mapping runs on."""
    before = show()
    (MAPPINGS / "press-3.yaml").write_text(BROKEN)
    done = timed("systemctl reload gatewayd")
    after = show()
    (MAPPINGS / "press-3.yaml").write_text(BROKEN_OTHERWISE)
    os.kill(int(before["MainPID"]), signal.SIGHUP)
    told = wait_for(lambda: "no_such_register" in show()["StatusText"])
    wait_for(lambda: show()["ActiveState"] == "active")
    found = {
        **done,
        "before": before,
        "after": after,
        "told": told,
        "after_a_bare_signal": show(),
        "version_of_status_block": registers(60000, 1)[0],
    }
    (MAPPINGS / "press-3.yaml").write_text(MORE)
    return found


@step
def reload_that_is_unsafe() -> Facts:
    """Refused by the running gateway: nothing is wrong with the file itself."""
    before = show()
    (MAPPINGS / "press-3.yaml").write_text(TURNED)
    checked = sh("gatewayd check /etc/gatewayd").returncode
    done = timed("systemctl reload gatewayd")
    found = {**done, "checked": checked, "before": before, "after": show()}
    (MAPPINGS / "press-3.yaml").write_text(MORE)
    return found


@step
def reload_without_control_socket() -> Facts:
    """By signal, as the drop-in says: asked for, not waited for."""
    drop_in = Path("/etc/systemd/system/gatewayd.service.d")
    drop_in.mkdir()
    example = Path("/usr/share/doc/gatewayd/examples/reload-by-signal.conf")
    (drop_in / example.name).write_text(example.read_text())
    sh("systemctl daemon-reload")
    done = timed("systemctl reload gatewayd")
    told = wait_for(lambda: "reload" not in show()["StatusText"])
    wait_for(lambda: show()["ActiveState"] == "active")
    (drop_in / example.name).unlink()
    drop_in.rmdir()
    sh("systemctl daemon-reload")
    return {**done, "told": told, "after": show()}


@step
def freeze() -> Facts:
    """A process that turns no more."""
    before = show()
    began = time.monotonic()
    if before["MainPID"] == "0":
        raise ProcessLookupError("nothing runs")
    os.kill(int(before["MainPID"]), signal.SIGSTOP)
    restarted = wait_for(lambda: show()["NRestarts"] != before["NRestarts"])
    noticed = time.monotonic() - began
    active = wait_for(lambda: show()["ActiveState"] == "active" and show()["MainPID"] != before["MainPID"])
    return {
        "restarted": restarted,
        "noticed": noticed,
        "served_again": time.monotonic() - began,
        "active": active and wait_for(is_fresh),
        "before": before,
        "after": show(),
        "journal": [one["MESSAGE"] for one in journal() if "atchdog" in str(one["MESSAGE"])],
    }


@step
def crash() -> Facts:
    """A process that is gone."""
    before = show()
    began = time.monotonic()
    if before["MainPID"] == "0":
        raise ProcessLookupError("nothing runs")
    os.kill(int(before["MainPID"]), signal.SIGSEGV)
    active = wait_for(
        lambda: show()["MainPID"] not in ("0", before["MainPID"]) and show()["ActiveState"] == "active"
    )
    return {"active": active, "served_again": time.monotonic() - began, "before": before, "after": show()}


@step
def upgrade() -> Facts:
    """While the cell runs: the new version serves the old mapping, and settings stay."""
    before = show()
    Path("/etc/default/gatewayd").write_text("# mine\n")
    done = timed(f"{DPKG} --install /srv/results/gatewayd-next.deb")
    return {
        **done,
        "before": before,
        "after": show(),
        "fresh": wait_for(is_fresh),
        "package": sh("dpkg-query -W -f '${Version}' gatewayd").stdout,
        "setting": Path("/etc/default/gatewayd").read_text(),
        "mapping": (MAPPINGS / "press-3.yaml").read_text() == MORE,
    }


def tell_of_python() -> Facts:
    """What dpkg does when the package of the system's Python came or went."""
    return timed(
        "dpkg-trigger --by-package=python3-minimal /usr/bin/python3 && dpkg --triggers-only --pending"
    )


@step
def another_python() -> Facts:
    """The environment in use is one of another Python than the system has now; and then it is the right one."""
    before = show()
    unchanged = {**tell_of_python(), "after": show()}
    current = (HOME / "env").readlink()
    (HOME / "env-3.0-former").mkdir()
    (HOME / "env").unlink()
    (HOME / "env").symlink_to("env-3.0-former")
    done = tell_of_python()
    return {
        **done,
        "unchanged": unchanged,
        "before": before,
        "after": show(),
        "fresh": wait_for(is_fresh),
        "right": (HOME / "env").readlink() == current,
        "environments": sorted(path.name for path in HOME.glob("env-*")),
    }


@step
def configure_with_a_mistake() -> Facts:
    """A version that would not serve the mapping does not replace the process that does."""
    before = show()
    (MAPPINGS / "press-3.yaml").write_text(BROKEN)
    done = timed(
        "dpkg-reconfigure -f noninteractive gatewayd || /var/lib/dpkg/info/gatewayd.postinst configure 0.1.0"
    )
    found = {**done, "before": before, "after": show()}
    (MAPPINGS / "press-3.yaml").write_text(MORE)
    return found


@step
def wall_clock() -> Facts:
    """A year ahead, and back to 1971, for longer than the watchdog waits; then as it was."""
    began, at = time.time(), time.monotonic()
    before, gaps = show(), registers(60048, 1)[0]
    seen = []
    for moment in (began + 365 * 86400, 365 * 86400.0):
        time.clock_settime(time.CLOCK_REALTIME, moment)
        until = time.monotonic() + 3
        fresh = True
        while time.monotonic() < until:
            fresh = fresh and registers(60007, 1)[0] == 2
            time.sleep(0.1)
        seen.append({"fresh": fresh, "robot fresh": is_fresh(), "state": show()})
    time.clock_settime(time.CLOCK_REALTIME, began + time.monotonic() - at)
    return {"before": before, "seen": seen, "gaps": registers(60048, 1)[0] - gaps}


@step
def mappings_by_git() -> Facts:
    """As howto/many-cells.md sets it up: another user fetches, the gateway serves what it has put into place."""
    examples, plant = "/usr/share/doc/gatewayd/examples", Path("/var/lib/plant")
    sh(f"""
        install -m 755 {examples}/gatewayd-mappings /usr/local/sbin/
        install -m 644 {examples}/gatewayd-mappings.service {examples}/gatewayd-mappings.timer /etc/systemd/system/
        install -D -m 644 {examples}/gatewayd-mappings.sysusers /etc/sysusers.d/gatewayd-mappings.conf
        systemd-sysusers gatewayd-mappings.conf
        git init --quiet --initial-branch=main {plant}
        chown -R gatewayd-mappings {plant}
    """)
    Path("/etc/default/gatewayd-mappings").write_text(f"MAPPINGS_REMOTE={plant}\n")

    def change(text: str) -> Facts:
        (plant / "press-3.yaml").write_text(text)
        commit = (
            f"cd {plant} && git add . && git -c user.name=a -c user.email=a@example.org commit -qm change"
        )
        committed = sh(f'runuser -u gatewayd-mappings -- sh -c "{commit}"')
        return {"committed": committed.stderr, **timed("systemctl start gatewayd-mappings")}

    first = change(MORE)
    drop_in = Path("/etc/systemd/system/gatewayd.service.d/mappings-by-git.conf")
    sh(f"install -D -m 644 {examples}/mappings-by-git.conf {drop_in}")
    sh("systemctl daemon-reload && systemctl restart gatewayd")
    bad = change(BROKEN)
    postinst = Path("/var/lib/dpkg/info/gatewayd.postinst").read_text()
    where = postinst.split("$(systemctl show", 1)[1].split(')"', 1)[0].replace('"$unit"', "gatewayd.service")
    found = {
        "first": first,
        "bad": bad,
        "state": show("gatewayd-mappings.service"),
        "gateway": show(),
        "command": Path(f"/proc/{show()['MainPID']}/cmdline").read_text().split("\0"),
        "checked by an upgrade": sh(f"systemctl show{where}").stdout.strip(),
        "journal": sh("journalctl --boot --no-pager --output=cat --unit=gatewayd-mappings").stdout,
        "timer": timed(
            "systemctl start gatewayd-mappings.timer && systemctl is-active gatewayd-mappings.timer"
        ),
        "modes": sh(
            "stat -c '%n %a %U:%G' /var/lib/gatewayd-mappings /var/lib/gatewayd-mappings/current/*"
        ).stdout,
        "metrics": sh("runuser -u nobody -- cat /run/gatewayd-mappings/gatewayd_mappings.prom").stdout,
        "touched": sh("runuser -u gatewayd -- touch /var/lib/gatewayd-mappings/current/x").returncode,
    }
    sh("systemctl stop gatewayd-mappings.timer; systemctl reset-failed gatewayd-mappings")
    drop_in.unlink()
    sh("systemctl daemon-reload")
    return found


@step
def stop() -> Facts:
    """Orderly."""
    sh("logger before-stop; journalctl --sync")
    done = timed("systemctl stop gatewayd")
    said = [one["MESSAGE"] for one in journal("--lines=5")]
    return {**done, "after": show(), "said": said}


@step
def start_with_a_mistake() -> Facts:
    """The only mapping is broken: it fails for good and says why, instead of starting again and again."""
    (MAPPINGS / "press-3.yaml").write_text(BROKEN)
    done = timed("systemctl start gatewayd")
    time.sleep(1.5)
    said = [str(one["MESSAGE"]) for one in journal("--lines=12")]
    found = {**done, "after": show(), "said": said}
    sh("systemctl reset-failed gatewayd")
    return found


@step
def one_cell() -> Facts:
    """The template, for one cell."""
    (MAPPINGS / "press-3.yaml").write_text(MORE)
    done = timed("systemctl start gatewayd@press-3")
    return {
        **done,
        "state": show("gatewayd@press-3.service"),
        "missing": timed("systemctl start gatewayd@nowhere"),
    }


@step
def remove() -> Facts:
    """With a cell running: it stops, the mapping stays."""
    done = timed("dpkg --remove gatewayd")
    return {
        **done,
        "after": show("gatewayd@press-3.service"),
        "program": Path("/usr/lib/gatewayd").exists() or Path("/usr/bin/gatewayd").exists(),
        "mapping": (MAPPINGS / "press-3.yaml").exists(),
        "setting": Path("/etc/default/gatewayd").exists(),
        "state": Path("/var/lib/gatewayd").exists(),
    }


@step
def purge() -> Facts:
    """What the package made goes; what somebody wrote stays."""
    done = timed("dpkg --purge gatewayd")
    mapping = (MAPPINGS / "press-3.yaml").exists()
    return {
        **done,
        "mapping": mapping,
        "setting": Path("/etc/default/gatewayd").exists(),
        "state": Path("/var/lib/gatewayd").exists(),
        "known": sh("dpkg-query -W -f '${Status}' gatewayd").stdout,
    }


def main() -> None:
    found: dict[str, Facts] = {}
    for one in STEPS:
        began = time.monotonic()
        try:
            found[one.__name__] = one()
        except Exception:  # noqa: BLE001 - the next step may tell more
            found[one.__name__] = {"defect": traceback.format_exc()}
        found[one.__name__]["took"] = time.monotonic() - began
        (RESULTS / "steps.json").write_text(json.dumps(found, indent=1))
        print(f"{one.__name__}: {found[one.__name__]['took']:.1f} s", flush=True)
    (RESULTS / "journal.log").write_text(sh("journalctl --boot --no-pager").stdout)


if __name__ == "__main__":
    main()
