"""What a controller says, and what a mapping file has in its free texts, never steers a terminal or a page."""

from __future__ import annotations

import json
import urllib.request
from http import HTTPStatus
from pathlib import Path
from urllib.error import HTTPError

import pytest
from click.testing import CliRunner

from gatewayd.cli import command
from tests.e2e.plant import Plant
from tests.e2e.plc import PLC
from tests.e2e.processes import HOST, Daemon, free_port, wait_for
from tests.e2e.test_control import gatewayd
from tests.web.browser import CHROMIUM, browsing

WORD = "\x1b[31mINT\x07"
TEXT = "ok\x1b]0;owned\x07\r\n2026-01-01T00:00:00.000Z info  fake=line \x9b2J \u202eevil\u2066 zero\u200bwidth <b>&"
UNIT = "N\x1b[32m\u202e\u200b"
CELL = f"""\
writers:
  plc: {{modbus: {PLC}}}
variables:
  number:  {{robot: input_int_register_0,  modbus: 0, owner: plc}}
  strange: {{robot: output_int_register_1, modbus: 100}}
  force:   {{robot: output_double_register_0, modbus: {{holding: 102, type: float32}}, unit: {json.dumps(UNIT)},
            comment: "a\\e[31m\\u202Eb"}}
"""


def ascii_escaped(text: str) -> str:
    return text.encode("unicode_escape").decode("ascii")


def assert_clean(text: str) -> None:
    for line in text.splitlines():
        assert line.isprintable(), ascii(line)


class Cell:
    def __init__(self, plant: Plant) -> None:
        self.plant = plant
        controller = plant.start("talking_controller", HOST, ascii_escaped(WORD), ascii_escaped(TEXT))
        self.mapping = plant.mapping(CELL, int(controller.answer()))
        self.socket = plant.directory / "control.sock"
        self.audit = plant.directory / "audit.jsonl"
        self.url = f"http://{HOST}:{free_port()}/"
        self.daemon: Daemon = plant.daemon(
            self.mapping,
            *("--control", self.socket, "--audit", self.audit, "--status", self.url[7:-1]),
        )
        self.daemon.wait_for_line("listening for control")
        self.daemon.wait_for_line("status page")
        self.daemon.wait_for_line("the controller says")
        self.daemon.wait_for_line("register unavailable")


@pytest.fixture(scope="module")
def cell(lasting_plant: Plant) -> Cell:
    return Cell(lasting_plant)


def test_the_text_log_keeps_every_event_on_one_line(cell: Cell) -> None:
    text = cell.daemon.text()
    assert_clean(text)
    said = cell.daemon.wait_for_line("the controller says")
    assert r"ok\x1b]0;owned\x07\r\n2026-01-01" in said
    assert r"\u202eevil\u2066 zero\u200bwidth" in said
    assert r"\x1b[31mINT\x07" in text
    assert not [line for line in text.splitlines() if line.startswith("2026-01-01")]


@pytest.mark.parametrize("line", ["status", "events", "watch --once", "locks", "events --audit"])
def test_commands_print_nothing_that_steers_the_terminal(cell: Cell, line: str) -> None:
    done = gatewayd(cell.socket, *line.split())
    assert_clean(done.stdout + done.stderr)
    if line == "events":
        assert r"\x1b[31mINT\x07" in done.stdout


def test_json_stays_exact(cell: Cell) -> None:
    done = gatewayd(cell.socket, "events", "--json")
    assert_clean(done.stdout)
    events = [json.loads(line) for line in done.stdout.splitlines()]
    assert any(WORD in event.get("detail", "") for event in events), events


def test_show_diff_and_check_print_free_texts_escaped(cell: Cell, tmp_path: Path) -> None:
    other = tmp_path / "other.yaml"
    other.write_text(cell.mapping.read_text("utf-8").replace("[31m", "[33m").replace("[32m", "[34m"), "utf-8")
    broken = tmp_path / "broken\x1b[31m.yaml"
    broken.write_text('gatewayd: 1\ncell: "x\\e[31m\\u202E"\n"k\\u200B": 1\n', "utf-8")
    outputs = [
        gatewayd_plain("show", cell.mapping),
        gatewayd_plain("show", "--format", "markdown", cell.mapping),
        gatewayd_plain("show", "--format", "csv", cell.mapping),
        gatewayd_plain("show", "--format", "json", cell.mapping),
        gatewayd_plain("diff", cell.mapping, other),
        gatewayd_plain("diff", "--format", "json", cell.mapping, other),
        gatewayd_plain("check", broken),
        gatewayd_plain("check", "--format", "json", broken),
        gatewayd_plain("check", "--format", "github", broken),
    ]
    for text in outputs:
        assert text
        assert_clean(text)
    shown = json.loads(outputs[3])
    assert shown["variables"][2]["unit"] == UNIT


def gatewayd_plain(*arguments: str | Path) -> str:
    return CliRunner().invoke(command, list(map(str, arguments))).output


def test_audit_and_metrics(cell: Cell) -> None:
    plc = cell.plant.ready_plc(PLC)
    assert plc.write_integers(0, 4) == 0
    wait_for(lambda: cell.audit.exists() and "write accepted" in cell.audit.read_text(), "the audit")
    assert_clean(cell.audit.read_text("utf-8"))
    for path in ("metrics", "readyz", "page/cells/cell", "page/cells/cell/state"):
        assert_clean(answer_of(cell.url + path))


def answer_of(url: str) -> str:
    """Also where it says that something is wrong: on a busy machine the packages may come too late."""
    try:
        answer = urllib.request.urlopen(url, timeout=10)  # noqa: S310 - our own listener
    except HTTPError as problem:
        if problem.code != HTTPStatus.SERVICE_UNAVAILABLE:
            raise
        answer = problem
    with answer:
        return str(answer.read().decode("utf-8"))


@pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed (Debian package chromium)")
async def test_the_page_shows_escapes(cell: Cell) -> None:
    async with browsing() as page:
        await page.open(cell.url, 1280, 800)
        await page.wait("document.body.dataset.contact === 'live'")
        await page.wait("document.body.textContent.includes('INT')")
        await page.run("document.querySelectorAll('#rows button.name')[2].click()")
        text = str(await page.run("document.body.innerText"))
        assert_clean(text.replace("\t", " ").replace("\xa0", " "))
        events = str(await page.run("document.body.textContent"))  # they are on a tab of their own
        assert r"\x1b[31mINT\x07" in events
        assert r"a\x1b[31m\u202eb" in text
