"""A Linux kernel with SocketCAN as an ordinary process, for machines whose own kernel has none (user-mode-linux).

One boot runs all the tests that were asked for: an inner pytest inside writes its reports, line by line, into a file
that the outer one reads. Several outer processes (xdist) share one boot: whoever comes first starts it. The kernel's
root is the machine's own file system, so nothing inside may write but below /run and in the directory of the results.
"""

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import shlex
import shutil
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO, Any

LIMIT = 180
"""Seconds for one boot with everything that runs in it."""
REPORTS = "GATEWAYD_KERNEL_REPORTS"
"""Environment variable that names the file for reports; set inside."""
TUNABLES = "glibc.cpu.hwcaps=-AVX2,-AVX,-AVX512F,-AVX512VL,-ERMS,-AVX_Fast_Unaligned_Load,-XSAVEC,-XSAVE"
"""GLIBC_TUNABLES inside: between processes the kernel keeps no more of the vector registers than SSE has."""
MEMORY = 512 << 20
_STARTED, _ENDED, _REPORTS, _CONSOLE = "started", "ended", "reports.jsonl", "console.log"
_MODULES = (
    "net/can/can",
    "net/can/can-raw",
    "net/can/can-bcm",
    "drivers/net/can/dev/can-dev",
    "drivers/net/can/vcan",
    "drivers/net/can/slcan/slcan",
)

_INIT = """\
#!/bin/sh
exec >{console} 2>&1 </dev/null
export PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/run TMPDIR=/run PYTHONDONTWRITEBYTECODE=1 {variable}={reports}
export GLIBC_TUNABLES={tunables}
mount -t proc proc /proc; mount -t sysfs sys /sys; mount -t tmpfs tmp /run
mount -t devtmpfs dev /dev 2>/dev/null; mkdir -p /dev/pts /dev/shm; mount -t devpts pts /dev/pts
cd {tree} || halt -f
for module in {modules}; do insmod "/usr/lib/uml/modules/$(uname -r)/kernel/$module.ko" || {insert} "$module"; done
ip link set lo up
echo 4194304 >/proc/sys/net/core/rmem_max
{python} -m pytest -p no:xdist -p no:cacheprovider --basetemp=/run/pytest {tests}
sync
halt -f || poweroff -f || {python} -c 'import os; os.sync(); import ctypes; ctypes.CDLL(None).reboot(0x4321fedc)'
"""

_INSERT = """\
import ctypes, os, sys
path = "/usr/lib/uml/modules/%s/kernel/%s.ko" % (os.uname().release, sys.argv[1])
libc = ctypes.CDLL(None, use_errno=True)
sys.exit(os.strerror(ctypes.get_errno()) if libc.syscall(313, os.open(path, os.O_RDONLY), b"", 0) else 0)
"""
"""insmod, for machines without kmod."""


class Boot:
    """One boot, shared by all who name the same directory.

    The directory's path goes onto the kernel's command line, so it must have no space.
    """

    def __init__(self, directory: Path, tree: Path) -> None:
        assert not any(character.isspace() for character in str(directory))
        self._directory = directory
        self._tree = tree
        self._init = f"init={directory / 'init'}"
        self._process: subprocess.Popen[bytes] | None = None

    @staticmethod
    def missing() -> str:
        """Why there can be no boot; empty if there can."""
        if shutil.which("linux.uml") is None:
            return "user-mode-linux is not installed (apt-get install user-mode-linux)"
        if os.uname().machine != "x86_64":
            return "user-mode-linux runs on x86_64 only"
        return ""

    def start(self, tests: Sequence[str]) -> None:
        """Boot and run the tests, unless somebody has done so already; returns at once."""
        self._directory.mkdir(parents=True, exist_ok=True)
        try:
            os.close(os.open(self._directory / _STARTED, os.O_CREAT | os.O_EXCL | os.O_WRONLY))
        except FileExistsError:
            return
        init = self._directory / "init"
        insert = self._directory / "insert.py"
        insert.write_text(_INSERT)
        init.write_text(
            _INIT.format(
                tunables=TUNABLES,
                console=self._directory / _CONSOLE,
                variable=REPORTS,
                reports=self._directory / _REPORTS,
                tree=shlex.quote(str(self._tree)),
                modules=" ".join(_MODULES),
                python=shlex.quote(sys.executable),
                insert=f"{shlex.quote(sys.executable)} {insert}",
                tests=shlex.join(tests),
            )
        )
        init.chmod(0o755)
        kernel = ["linux.uml", f"mem={MEMORY >> 20}M", "rootfstype=hostfs", "rw", self._init]
        kernel += ["con=null", "con0=null,fd:1", "quiet"]
        # The shell outlives the kernel, whatever becomes of that, and says so.
        script = f'timeout -k 2 {LIMIT} "$@" >"$0/kernel.log" 2>&1 </dev/null; echo $? >"$0/{_ENDED}"'
        self._process = launch(["/bin/sh", "-c", script, str(self._directory), *kernel], MEMORY)

    def reports(self, test: str) -> Iterator[dict[str, Any]]:
        """The inner reports on one test, waited for. Fewer than three if the kernel ended before the test did."""
        ended = False
        deadline = time.monotonic() + LIMIT + 10
        while True:
            found = [report for report in self._read() if report["nodeid"] == test]
            if ended or any(report["when"] == "teardown" for report in found):
                yield from found
                return
            ended = (self._directory / _ENDED).exists() or time.monotonic() > deadline
            time.sleep(0.1)

    def _read(self) -> Iterator[dict[str, Any]]:
        with contextlib.suppress(FileNotFoundError), (self._directory / _REPORTS).open() as file:
            for line in file:
                with contextlib.suppress(json.JSONDecodeError):  # the last one is being written
                    yield json.loads(line)

    def story(self) -> str:
        """What was said on the way: the end of the kernel's console and of the inner run's output."""
        parts = []
        for name in ("kernel.log", _CONSOLE):
            with contextlib.suppress(FileNotFoundError):
                parts.append(f"{name}:\n" + (self._directory / name).read_text(errors="replace")[-3000:])
        return "\n".join(parts) or "the kernel said nothing"

    def end(self, *, now: bool) -> None:
        """Wait for the kernel that this process started, which others may still read from; or end it at once."""
        if self._process is None:
            return
        if now:
            _kill_all_with(self._init)
        self._process.wait()
        _kill_all_with(self._init)  # the kernel's processes outlive a kernel that was killed


def _kill_all_with(argument: str) -> None:
    """End every process that was started with this argument, which names one boot: the kernel leaves its session."""
    for entry in Path("/proc").iterdir():
        with contextlib.suppress(ValueError, OSError):
            if argument.encode() in (entry / "cmdline").read_bytes().split(b"\0"):
                os.kill(int(entry.name), signal.SIGKILL)


def launch(command: Sequence[str], memory: int, output: IO[bytes] | None = None) -> subprocess.Popen[bytes]:
    """Start a kernel with so many bytes of memory, in a session of its own."""
    return subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=output,
        stderr=subprocess.STDOUT if output is not None else None,
        preexec_fn=_without_xstate,  # noqa: PLW1509 - tests start no threads
        start_new_session=True,
        env={**os.environ, "TMPDIR": _place_of_memory(memory)},
    )


def _place_of_memory(size: int) -> str:
    """Where a kernel's memory may lie: in shared memory if there is enough, of which containers have little."""
    with contextlib.suppress(OSError):
        place = os.statvfs("/dev/shm")  # noqa: S108 - the question is how big it is
        if place.f_bavail * place.f_frsize > size:
            return "/dev/shm"  # noqa: S108 - user-mode-linux makes its own file in it, and unlinks it
    return "/tmp"  # noqa: S108 - the same


def _without_xstate() -> None:
    """Let this process and its children see a machine without PTRACE_GETREGSET (seccomp, no privilege needed).

    Linux 6.1 as user-mode-linux asks for 2.7 kB of extended registers and dies on processors that have more of them
    (AMX: 11 kB). Where the request fails altogether it is content with those of SSE.
    """
    load, equal, answer = 0x20, 0x15, 0x06
    ptrace, get_register_set, set_register_set = 101, 0x4204, 0x4205
    refuse, allow = 0x0005_0005, 0x7FFF_0000  # EIO
    program = b"".join(
        struct.pack("=HBBI", *instruction)
        for instruction in (
            (load, 0, 0, 0),
            (equal, 0, 4, ptrace),
            (load, 0, 0, 16),
            (equal, 1, 0, get_register_set),
            (equal, 0, 1, set_register_set),
            (answer, 0, 0, refuse),
            (answer, 0, 0, allow),
        )
    )
    buffer = ctypes.create_string_buffer(program, len(program))
    header = ctypes.create_string_buffer(struct.pack("@HP", len(program) // 8, ctypes.addressof(buffer)))
    libc = ctypes.CDLL(None)
    set_no_new_privileges, set_seccomp, mode_filter = 38, 22, 2
    libc.prctl(set_no_new_privileges, 1, 0, 0, 0)
    libc.prctl(set_seccomp, mode_filter, header, 0, 0)
