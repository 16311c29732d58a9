"""A machine with systemd as PID 1 to install on, as an ordinary process (user-mode-linux), and the package to install.

`python -m tests.systemd.machine DIRECTORY` makes the package there, lets scenario.py try it, and leaves `ended`. The
machine's root is the file system of this one, mounted read-only, with an overlay in memory on top: inside, everything
can be installed, removed and broken, and nothing of it reaches this machine but the directory of the results.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import shlex
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from gatewayd import __version__
from tests.kernel.uml import TUNABLES, Boot, launch

ROOT = Path(__file__).parents[2]
ENDED = "ended"
"""Name of the file with the kernel's exit status, which comes last."""
NEXT = f"{__version__}+next"
"""Version of the package that is installed over the first one."""
LIMIT = 420
"""Seconds for one boot with everything that runs in it; a machine with nothing else to do needs 90."""
MEMORY = 1 << 30
_MODULES = (
    "fs/overlayfs/overlay",
    "net/can/can",
    "net/can/can-raw",
    "drivers/net/can/dev/can-dev",
    "drivers/net/can/vcan",
)

_INIT = """\
#!/bin/sh
export PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/ GLIBC_TUNABLES={tunables}
mount -t proc proc /proc; mount -t sysfs sys /sys; mount -t tmpfs -o size=80% tmp /mnt
mkdir /mnt/results /mnt/upper /mnt/work /mnt/root
mount -t hostfs -o {results} results /mnt/results || halt -f
exec >/mnt/results/init.log 2>&1 </dev/null
for module in {modules}; do
    {python} -I {results}/insert.py "/usr/lib/uml/modules/$(uname -r)/kernel/$module.ko" || echo "no $module"
done
mount -t overlay overlay -o lowerdir=/,upperdir=/mnt/upper,workdir=/mnt/work /mnt/root || halt -f
cd /mnt/root
# Of the machine's own services nothing starts.
rm -rf .dockerenv usr/sbin/policy-rc.d etc/systemd/system etc/fstab etc/network etc/rc?.d etc/init.d
rm -rf etc/gatewayd usr/lib/gatewayd var/lib/gatewayd
mkdir -p etc/systemd/system etc/systemd/system.conf.d etc/systemd/journald.conf.d srv/results
for unit in {masked}; do ln -s /dev/null etc/systemd/system/$unit; done
printf '[Manager]\\nDefaultEnvironment=GLIBC_TUNABLES={tunables}\\nDefaultTimeoutStopSec=5s\\n' \\
    >etc/systemd/system.conf.d/test.conf
printf '[Journal]\\nStorage=volatile\\nRateLimitIntervalSec=0\\n' >etc/systemd/journald.conf.d/test.conf
printf '[Unit]\\nRequires=basic.target scenario.service\\n' >etc/systemd/system/test.target
printf '%s\\n' '[Unit]' 'After=basic.target' '[Service]' 'Type=oneshot' \\
    'ExecStart=/usr/bin/python3 -I /srv/results/scenario.py /srv/results' \\
    'StandardOutput=append:/srv/results/scenario.log' 'StandardError=inherit' \\
    'ExecStopPost=/usr/bin/systemctl halt --force --force' >etc/systemd/system/scenario.service
echo 0123456789abcdef0123456789abcdef >etc/machine-id
mount -t hostfs -o {results} results srv/results || halt -f
exec 3>&1 >/dev/console 2>&1
exec switch_root /mnt/root /lib/systemd/systemd --unit=test.target
"""

_MASKED = (
    "systemd-udevd.service systemd-udev-trigger.service systemd-modules-load.service systemd-hwdb-update.service "
    "systemd-random-seed.service systemd-update-utmp.service systemd-timesyncd.service systemd-networkd.service "
    "systemd-resolved.service systemd-logind.service systemd-binfmt.service systemd-firstboot.service "
    "systemd-remount-fs.service systemd-boot-update.service systemd-pcrphase.service systemd-pcrphase-sysinit.service "
    "systemd-journal-catalog-update.service ldconfig.service apparmor.service dev-hugepages.mount "
    "systemd-tmpfiles-setup-dev.service systemd-machine-id-commit.service systemd-journal-flush.service "
    "e2scrub_reap.service fstrim.timer apt-daily.timer apt-daily-upgrade.timer dpkg-db-backup.timer e2scrub_all.timer "
    "systemd-tmpfiles-clean.timer systemd-tmpfiles-setup.service systemd-sysusers.service systemd-sysctl.service "
    "modprobe@configfs.service modprobe@dm_mod.service modprobe@fuse.service modprobe@loop.service "
    "sys-kernel-config.mount sys-fs-fuse-connections.mount proc-sys-fs-binfmt_misc.automount dbus.socket"
)

_INSERT = """\
import ctypes, os, sys
libc = ctypes.CDLL(None, use_errno=True)
failed = libc.syscall(313, os.open(sys.argv[1], os.O_RDONLY), b"", 0)
sys.exit(os.strerror(ctypes.get_errno()) if failed else 0)
"""
"""insmod, for machines without kmod."""


@cache
def can_build() -> bool:
    """Whether this interpreter has what packaging/deb needs: pip, and what requirements.lock names."""
    needed = "import pip, flit_core, click"
    return subprocess.run([sys.executable, "-c", needed], capture_output=True, check=False).returncode == 0


def has_dpkg_deb() -> bool:
    """Whether packages can be built."""
    return shutil.which("dpkg-deb") is not None


@contextlib.contextmanager
def _locked(path: Path) -> Iterator[None]:
    """One process at a time."""
    with path.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def _system_python() -> str:
    """Its version, as in 3.11."""
    command = ["/usr/bin/python3", "-Ic", "import sys; print('%d.%d' % sys.version_info[:2])"]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()


def package(directory: Path) -> Path:
    """The Debian package of this tree in a directory that others use too; made if it is not there.

    With the wheels for this system's Python alone: what pip has fetched already for the tests' own environment.
    """
    with _locked(directory / "package.lock"):
        found = list(directory.glob("gatewayd_*.deb"))
        if not found:
            done = subprocess.run(
                [ROOT / "packaging/deb", directory, sys.executable],
                capture_output=True,
                text=True,
                check=False,
                env={**os.environ, "COMPRESSION": "gzip", "PYTHONS": _system_python()},
            )
            assert done.returncode == 0, done.stderr
            found = [Path(done.stdout.strip())]
    return found[0]


def _make_next(package: Path, results: Path) -> None:
    """The same package under a later version."""
    tree = results / "next"
    subprocess.run(["dpkg-deb", "--raw-extract", package, tree], check=True)
    control = tree / "DEBIAN/control"
    control.write_text(control.read_text().replace(f"Version: {__version__}\n", f"Version: {NEXT}\n"))
    target = results / "gatewayd-next.deb"
    build = ["dpkg-deb", "--root-owner-group", "-Zgzip", "-z1", "--build"]
    subprocess.run([*build, tree, target], check=True, capture_output=True)
    shutil.rmtree(tree)


def missing() -> str:
    """Why there can be no boot; empty if there can."""
    kernel = Boot.missing()
    if kernel:
        return kernel
    if not Path("/lib/systemd/systemd").exists() or shutil.which("systemctl") is None:
        return "systemd is not installed (apt-get install systemd)"
    if shutil.which("dpkg") is None:
        return "this machine has no dpkg"
    if os.geteuid() != 0:
        return "only root can offer the whole file system to the machine inside"
    return ""


def _boot(results: Path, scenario: Path) -> int:
    """Boot, run the program `scenario` as root with `results` as its argument, halt. Returns the kernel's exit status.

    `results` must be a path without spaces; init.log, scenario.log and kernel.log in it tell what happened.
    """
    assert not any(character.isspace() for character in str(results))
    shutil.copy(scenario, results / "scenario.py")
    (results / "insert.py").write_text(_INSERT)
    init = results / "init"
    init.write_text(
        _INIT.format(
            results=results,
            tunables=TUNABLES,
            python="/usr/bin/python3",
            modules=shlex.join(_MODULES),
            masked=_MASKED,
        )
    )
    init.chmod(0o755)
    kernel = ["linux.uml", f"mem={MEMORY >> 20}M", "rootfstype=hostfs", "ro", f"init={init}", "quiet"]
    kernel += ["con=null", "con0=null,fd:1"]
    with (results / "kernel.log").open("wb") as log:
        machine = launch(kernel, MEMORY, log)
    try:
        return machine.wait(LIMIT)
    except subprocess.TimeoutExpired:
        return -1
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(machine.pid, signal.SIGKILL)
        machine.wait()


def main(directory: Path) -> None:
    """Everything, as said above; `results` in the directory is what the scenario sees and fills."""
    results = directory / "results"
    results.mkdir()
    status = "no boot"
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    try:
        found = package(directory)
        shutil.copy(found, results / "gatewayd.deb")
        _make_next(found, results)
        status = str(_boot(results, Path(__file__).with_name("scenario.py")))
    finally:
        (directory / ENDED).write_text(status)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
