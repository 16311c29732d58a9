"""The commands of tutorial and guides: each is known here, and what can be run is run."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from contextlib import chdir
from itertools import takewhile
from pathlib import Path

import click
import pytest
from click.testing import CliRunner, Result

from gatewayd.cli import command
from tests.docs.generated import DOCS

PAGES = sorted([*DOCS.glob("tutorial/*.md"), *DOCS.glob("howto/*.md")])
BLOCK = re.compile(r"^```sh\n(.*?)^```", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"<!-- file: (\S+) -->\n```yaml\n(.*?)^```", re.MULTILINE | re.DOTALL)

ELSEWHERE = {
    r'export PATH="\$PWD/\.venv/bin:\$PATH"': "the shell's own",
    r"gatewayd demo": "tests/cli/test_demo.py",
    r"gatewayd run .*": "tests/docs/test_tutorial.py, tests/e2e",
    r"gatewayd diff .*": "tests/cli/test_diff.py",
    r"gatewayd (status|watch|locks|events|force|unforce|trace)\b.*": "tests/cli, tests/e2e",
    r"gatewayd devices\b.*": "tests/cli/devices, tests/links/devices",
    r"gatewayd doctor .*": "tests/cli/test_doctor.py",
    r"gatewayd import csv .*": "tests/cli/importing/test_csv.py, with the list of the guide",
    r"gatewayd rtde (record|watch|get|set|message|fields|info|convert|plot) .*": "tests/cli/rtde",
    r"gatewayd import eds .*": "tests/cli/importing/test_eds.py",
    r"gatewayd import rtde .*": "tests/cli/importing",
    r"pip install 'gatewayd\[\w+\]'": "the extras of pyproject.toml, locked in requirements-dev.lock",
    r"\.venv/bin/python docs/examples/.*": "tests/docs/test_examples.py, test_device_tutorials.py",
    r"gatewayd reload|systemctl reload .*": "tests/e2e/test_reload.py",
    r"gatewayd simulate\b.*": "test_simulator_takes_the_options_of_the_guides below, tests/cli/test_simulate.py",
    r"mbpoll -0 -p 1502 -t 4:int -B -r 101 -c 2 127\.0\.0\.1": "tests/demo/test_view.py: the demonstration's own",
    r"mbpoll -0 .*": "tests/docs/test_tutorial.py, test_device_tutorials.py, with another Modbus client",
    r"make (bench|demo)\b.*": "the Makefile; tests/test_docs.py knows its targets",
    r"make soak\b.*": "tests/soak/test_soak.py; tests/test_docs.py knows the target",
    r"(sudo )?gatewayd token .*": "tests/cli/test_token.py",
    r"sudo install .*": "the system's",
    r"cd /|umask 077|find etc/gatewayd/ .*|tar --(create|extract) .*": "tests/fleet/test_back_up.py",
    r"cd /usr/share/doc/gatewayd/examples|ssh-key(gen|scan) .*|chown gatewayd-mappings .*": "the system's",
    r"ln -s /run/gatewayd-mappings/.*": "the system's; tests/fleet/site.py writes the file",
    r"gatewayd standby switch && sudo apt upgrade gatewayd": "tests/e2e/test_standby.py, without the upgrade",
    r"openssl req .*": "tests/machine/authority.py issues certificates so",
    r"curl --cacert .*": "tests/web/test_beyond_loopback.py, with another client",
    r"curl -X POST .* http://127\.0\.0\.1:9502/api/v1/locks/start/take": "tests/web/test_listener.py",
    r"promtool check .*": "tests/web/test_promtool.py",
    r"sudo systemctl reload prometheus": "Prometheus' own",
    r"(sudo )?apt install .*|apt-get install .*": "the system's",
    r"sudo modprobe vcan|sudo ip link .*|ip -details .*": "the system's; tests/kernel sets interfaces up this way",
    r"candump vcan0|(while sleep 0\.4; do )?cansend vcan0 \S+( done)?": "tests/docs/test_canopen_tutorial.py",
    r"make (deb|install)\b.*|man gatewayd": "tests/systemd/test_package.py",
    r"make image|podman .*": "packaging/image, by hand: docs/howto/install.md says what came of it",
    r"nft -f .*": "tests/systemd/test_nftables.py",
    r"unpacked/usr/lib/gatewayd/make-environment --root unpacked": "tests/systemd/test_package.py",
    r"gatewayd --version": "tests/cli/test_main.py",
    r"gatewayd (check|show) /etc/gatewayd.*": "tests/systemd/test_boot.py",
    r"unpacked/usr/lib/gatewayd/env/bin/python3 -I -m gatewayd check /etc/gatewayd": "tests/systemd/test_package.py",
    r"systemctl .*|systemd-sysusers .*": "tests/systemd/test_boot.py",
    r"(journalctl|networkctl|install|editor|cp|dpkg-deb) .*": "the system's",
}
"""Command (the whole line) -> what else tests it."""

RUN = re.compile(r"gatewayd (check|test|show|export) (?!/etc/).*")
"""What test_commands_work runs."""


def commands(page: Path) -> Iterator[str]:
    """The lines of the page's shell blocks, without comments."""
    for block in BLOCK.findall(page.read_text()):
        for line in block.splitlines():
            typed = re.sub(r"\s+#.*", "", line).strip()
            if typed:
                yield typed


WHOLE = {"secure-modbus.md": "tests/docs/test_secure_modbus.py"}
"""Pages whose shell blocks a test runs as they are, one after the other."""

ALL = [(page, line) for page in PAGES if page.name not in WHOLE for line in commands(page)]


def test_every_command_is_known() -> None:
    unknown = [
        f"{page.name}: {line}"
        for page, line in ALL
        if not RUN.fullmatch(line) and not any(re.fullmatch(known, line) for known in ELSEWHERE)
    ]
    assert not unknown


def refusal(line: str) -> str:
    """What the command says against its arguments, without being carried out; empty if it takes them."""
    current: click.Command = command
    arguments = list(takewhile(lambda word: word not in {"|", ">", "&", "&&"}, shlex.split(line)))[1:]
    context = click.Context(command, info_name="gatewayd")
    while isinstance(current, click.Group) and arguments and not arguments[0].startswith("-"):
        name, found, arguments = current.resolve_command(context, arguments)
        assert found is not None
        current, context = found, click.Context(found, parent=context, info_name=name)
    try:
        current.parse_args(context, list(arguments))
    except click.exceptions.Exit:
        return ""
    except click.UsageError as error:
        return "" if "does not exist" in error.format_message() else error.format_message()
    return ""


def test_every_command_takes_its_arguments() -> None:
    """Options, their values and the number of arguments; also of commands that other tests carry out."""
    refused = [
        f"{page.name}: {line}: {why}"
        for page, line in ALL
        if line.startswith("gatewayd ") and (why := refusal(line))
    ]
    assert not refused


@pytest.fixture
def files(tmp_path: Path) -> Path:
    """A directory with every file that the pages show, and the data sheet that one has the reader copy."""
    (tmp_path / "encoder.eds").write_bytes((DOCS.parent / "mappings" / "encoder.eds").read_bytes())
    for page in PAGES:
        for name, text in FILE.findall(page.read_text()):
            (tmp_path / name).write_text(text)
    return tmp_path


def gatewayd(arguments: str, directory: Path) -> Result:
    """Run `gatewayd ARGUMENTS` there."""
    with chdir(directory):
        return CliRunner(env={"COLUMNS": "110"}).invoke(command, shlex.split(arguments), prog_name="gatewayd")


def test_commands_work(files: Path) -> None:
    runnable = {line for _, line in ALL if RUN.fullmatch(line)}
    assert runnable
    for line in sorted(runnable):
        done = gatewayd(line.removeprefix("gatewayd ").partition(" > ")[0], files)
        assert done.exit_code == 0, f"{line}: {done.output}"


def test_files_of_the_pages_have_no_findings(files: Path) -> None:
    names = sorted(path.name for path in files.glob("*.yaml"))
    assert "my-cell.yaml" in names
    done = gatewayd("check --strict --separately " + " ".join(names), files)
    assert "no findings" in done.stdout, done.stdout


def test_the_failure_of_the_guide_to_tests_is_the_real_one(files: Path) -> None:
    page = (DOCS / "howto" / "test-a-mapping.md").read_text()
    text = (files / "tested-cell.yaml").read_text()
    (files / "tested-cell.yaml").write_text(text.replace("3s, expect: {speed: 0}", "3s, expect: {speed: 50}"))
    done = gatewayd("test tested-cell.yaml", files)
    assert done.exit_code == 1
    for line in done.stdout.splitlines()[:2]:
        assert line in page


def test_the_tests_of_the_tutorial_pass(files: Path) -> None:
    page = (DOCS / "tutorial" / "2-own-mapping.md").read_text()
    (tests,) = re.findall(r"```yaml\n(tests:.*?)```", page, re.DOTALL)
    with (files / "my-cell.yaml").open("a", encoding="utf-8") as file:
        file.write(tests)
    assert "1 passed, 0 failed" in gatewayd("test my-cell.yaml", files).stdout


def test_mistakes_of_the_tutorial_are_found_as_it_says(files: Path) -> None:
    page = (DOCS / "tutorial" / "2-own-mapping.md").read_text()
    text = (files / "my-cell.yaml").read_text()
    broken = text.replace("modbus: 0.0, owner: plc", "modbus: 0.0, owner: plv").replace(
        "output_int_register_0, modbus: 101", "output_int_register_0, modbus: 100"
    )
    (files / "my-cell.yaml").write_text(broken)
    done = gatewayd("check my-cell.yaml", files)
    assert done.exit_code == 1
    for line in done.stdout.splitlines():
        if (
            re.search(r"\berror\b|first used", line)
            and "files checked" not in line
            and "checked:" not in line
        ):
            assert line in page


def test_table_of_the_tutorial_is_the_real_one(files: Path) -> None:
    page = (DOCS / "tutorial" / "2-own-mapping.md").read_text()
    shown = gatewayd("show my-cell.yaml", files).stdout
    for line in filter(None, map(str.strip, shown.splitlines()[:10])):
        assert line in page


def test_fingerprint_of_the_guide_to_word_order_is_that_of_the_tutorial(files: Path) -> None:
    page = (DOCS / "howto" / "word-order.md").read_text()
    found = re.search(
        r"fingerprint (\w{4})(\w{4})$", gatewayd("show press-plc.yaml", files).stdout, re.MULTILINE
    )
    assert found
    high, low = found.groups()
    assert f"prints the fingerprint: {high}{low}\n" in page
    orders = {
        "ABCD": high + low,
        "CDAB": low + high,
        "BADC": high[2:] + high[:2] + low[2:] + low[:2],
        "DCBA": low[2:] + low[:2] + high[2:] + high[:2],
    }
    for order, shown in orders.items():
        assert f"| 16#{shown} | `{order}` |" in page


OPTIONS = {
    option
    for page in PAGES
    for line in re.findall(r"`(--[^`]+)`|gatewayd simulate (.*)", page.read_text())
    if page.name == "simulate-faults.md"
    for option in re.findall(r"--[a-z0-9-]+", " ".join(line))
}


def test_simulator_takes_the_options_of_the_guides() -> None:
    text = gatewayd("simulate --help", DOCS.parent).stdout
    assert OPTIONS
    assert {option for option in OPTIONS if option not in text} == set()
