"""The parts of docs/ that are made from the code, and how they get into their pages.

A page holds a part between `<!-- generated: NAME -->` and `<!-- end -->`. `python -m tests.docs` renews all of them;
tests/docs/test_generated.py fails while one is not current.
"""

from __future__ import annotations

import ast
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache, partial
from importlib import import_module
from pathlib import Path
from textwrap import indent
from typing import Any

import click

from gatewayd.cli import COMMANDS
from gatewayd.cli import command as root_command
from gatewayd.core.events import EventKind
from gatewayd.core.freshness import Source
from gatewayd.core.image import Quality
from gatewayd.core.objection import MEANINGS
from gatewayd.core.program import STATES
from gatewayd.core.refusal import PRECEDENCE, Reason
from gatewayd.core.status_layout import BASE, TABLES
from gatewayd.links.modbus_server.functions import EXCEPTION_OF
from gatewayd.links.registry import kinds, status_fields
from gatewayd.links.registry import status_tables as link_tables
from gatewayd.links.robot.dashboard.results import WORDS
from gatewayd.logs.events import LEVELS
from gatewayd.logs.records import LEVELS as LEVEL_NAMES
from gatewayd.mapping.schema import mapping_schema
from gatewayd.modbus.areas import Area
from gatewayd.modbus.exceptions import ExceptionCode
from gatewayd.report.schema import documented
from gatewayd.rtde.fields import INPUTS, OUTPUTS, Field, Series
from gatewayd.web.histogram import BOUNDS
from gatewayd.web.metrics import METRICS, PROCESS_METRICS
from tests.docs import canopen, examples
from tests.docs.canopen import table
from tests.docs.rtde_clients.rows import CLIENTS
from tests.docs.rtde_clients.rows import part as rtde_client_rows

ROOT = Path(__file__).parent.parent.parent
DOCS = ROOT / "docs"
HELP_WIDTH = 100

_PART = re.compile(r"(<!-- generated: ([\w-]+) -->\n)(.*?)(<!-- end -->)", re.DOTALL)


def pages() -> list[Path]:
    """The pages with generated parts."""
    return [page for page in sorted(DOCS.rglob("*.md")) if _PART.search(page.read_text())]


def renewed(text: str) -> str:
    """The text of a page with its generated parts made anew."""
    return _PART.sub(lambda found: f"{found[1]}\n{PARTS[found[2]]().strip()}\n\n{found[4]}", text)


# -- mapping file -----------------------------------------------------------------------------------------------------

_SECTIONS = {
    "": "The file",
    "RobotSection": "`robot:`",
    "Watchdog": "`robot: watchdog:`",
    "DashboardSection": "`robot: dashboard:`",
    "Modbus": "`modbus:`",
    "Tls": "`modbus: tls:`",
    "RoleSpec": "A role: `modbus: tls: roles:` and `without_role`",
    "Canopen": "`canopen:`",
    "IdentitySpec": "`canopen: identity:`",
    "Sync": "`canopen: sync:`",
    "Guarding": "`canopen: guarding:`",
    "Emcy": "`canopen: emcy:`",
    "PdoDefaults": "`canopen: pdo:`",
    "CobIdPool": "`canopen: cob_ids:`",
    "PdoSpec": "`canopen: pdos:` NAME`:`",
    "DeviceSpec": "`devices:` NAME`:`",
    "MqttSection": "`mqtt:`",
    "MqttTls": "`mqtt: tls:`",
    "MqttStore": "`mqtt: store:`",
    "SparkplugSection": "`mqtt: sparkplug:`",
    "Standby": "`standby:`",
    "WriterSpec": "`writers:` NAME`:`",
    "Group": "`groups:` NAME`:`",
    "VariableSpec": "`variables:` NAME`:`",
    "RobotField": "`variables:` NAME`: robot:`",
    "PlacementSpec": "`variables:` NAME`: modbus:`",
    "CanopenPlace": "`variables:` NAME`: canopen:`",
    "DevicePlaceSpec": "`variables:` NAME`: device:`",
    "MqttPlaceSpec": "`variables:` NAME`: mqtt:`",
    "StepSpec": "`tests:` NAME`:`, each step",
}
_DURATION = re.compile(r"ms\|s\|min\|h")


def mapping_keys() -> str:
    """Every key of the mapping file with type, default and meaning."""
    schema = mapping_schema()
    parts = []
    sections = {"": schema, **schema["$defs"]}
    for name, title in _SECTIONS.items():
        section = sections.pop(name)
        rows = [
            (
                f"`{key}`",
                _type(value),
                _default(key, value, section.get("required", ())),
                value["description"],
            )
            for key, value in section["properties"].items()
        ]
        parts.append(f"### {title}\n\n" + table(("key", "type", "default", "meaning"), rows))
    assert not sections, f"no title for {list(sections)}"
    return "\n\n".join(parts)


def _type(schema: Mapping[str, Any]) -> str:
    return " or ".join(dict.fromkeys(_types(schema)))


def _types(schema: Mapping[str, Any]) -> Iterator[str]:
    if "anyOf" in schema:
        for choice in schema["anyOf"]:
            yield from _types(choice)
    elif len(schema.get("enum", ())) > _MANY_WORDS:
        yield "text"
    elif "enum" in schema or "const" in schema:
        yield from (f"`{word}`" for word in schema.get("enum", [schema.get("const")]))
    elif _DURATION.search(schema.get("pattern", "")):
        yield "duration"
        if "none" in schema["pattern"]:
            yield "`none`"
    elif "prefixItems" in schema:
        yield "two numbers"
    else:
        yield _TYPES[schema.get("type", "object")] + _range(schema)


_MANY_WORDS = 16
"""Choices that a cell of a table can hold; the meaning says where more are listed."""
_TYPES = {
    "array": "list",
    "boolean": "`true`, `false`",
    "integer": "whole number",
    "number": "number",
    "object": "table",
    "string": "text",
}


def _range(schema: Mapping[str, Any]) -> str:
    low, high = schema.get("minimum", schema.get("exclusiveMinimum")), schema.get("maximum")
    if high is not None:
        return f" {low} to {high}"
    return f" from {low}" if low is not None else ""


def _default(key: str, schema: Mapping[str, Any], required: Iterable[str]) -> str:
    if key in required:
        return "required"
    value = schema.get("default")
    if value in (None, "", [], {}):
        return ""
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if "duration" in _type(schema):
        return f"`{value:g}s`"
    return f"`{value:g}`" if isinstance(value, float) else f"`{value}`"


# -- command line -----------------------------------------------------------------------------------------------------


def command_names() -> list[str]:
    """Every command as it is typed after `gatewayd`; the empty one first, groups before what is in them."""
    names = [""]
    root = click.Context(root_command)
    for name in COMMANDS:
        command = root_command.get_command(root, name)
        names.append(name)
        if isinstance(command, click.Group):
            names += [f"{name} {inner}" for inner in command.list_commands(click.Context(command))]
    return names


_PRINT_HELPS = """\
import json, sys
from contextlib import redirect_stdout
from io import StringIO
from gatewayd.cli import command
helps = {}
for name in sys.argv[1:]:
    with redirect_stdout(StringIO()) as printed:
        command.main([*name.split(), "--help"], prog_name="gatewayd", standalone_mode=False)
    helps[name] = printed.getvalue()
print(json.dumps(helps))
"""


@cache
def help_texts() -> dict[str, str]:
    """What `gatewayd NAME --help` prints, by name; `gatewayd --help` for the empty name."""
    # In a process of its own: here, click may remember the help option of somebody who asked without `gatewayd`.
    printed = subprocess.run(
        [sys.executable, "-c", _PRINT_HELPS, *command_names()],
        check=True,
        capture_output=True,
        text=True,
        cwd=ROOT,
        env=os.environ | {"COLUMNS": str(HELP_WIDTH + 2)},
    ).stdout
    return {name: text.rstrip() for name, text in json.loads(printed).items()}


def command_line() -> str:
    """The help of every command."""
    parts = [
        f"## gatewayd {name}".rstrip() + "\n\n" + indent(text, "    ") for name, text in help_texts().items()
    ]
    return "\n\n".join(parts)


def exit_codes() -> str:
    """What each command says about its exit codes, in one table."""
    rows = []
    for name, text in help_texts().items():
        codes = text.partition("Exit codes:\n")[2]
        rows += [
            (f"`gatewayd {name}`" if name else "any command", found[1], found[2])
            for found in re.finditer(r"^ +(\d+) +(.+)$", codes, re.MULTILINE)
        ]
    return table(("command", "code", "meaning"), rows)


# -- what can be seen on the bus --------------------------------------------------------------------------------------


def _places(offset: int, words: int) -> tuple[str, str]:
    first, last = BASE + offset, BASE + offset + words - 1
    if first == last:
        return str(first), Area.HOLDING.notation(first)
    return f"{first}-{last}", f"{Area.HOLDING.notation(first)}-{Area.HOLDING.notation(last)}"


def status_header() -> str:
    """The numbers of the status block."""
    rows = [
        (*_places(field.offset, field.words), f"`{field.name}`", field.meaning) for field in status_fields()
    ]
    return table(("address", "4xxxxx", "name", "meaning"), rows)


def status_tables() -> str:
    """The tables of the status block."""
    rows = [
        (*_places(status_table.offset, status_table.words), f"`{status_table.name}`", status_table.meaning)
        for status_table in (*TABLES, *link_tables())
    ]
    return table(("address", "4xxxxx", "name", "meaning"), rows)


def status_entries() -> str:
    """The words of one entry of each table that links report."""
    (devices,) = link_tables()
    rows = [(f"+{number}", f"`{name}`", meaning) for number, (name, meaning) in enumerate(devices.entry)]
    return table(("word", "name", "meaning"), rows)


_QUALITIES = {
    Quality.GOOD: "the value is the latest from its source, and the source is alive",
    Quality.STALE: "the source has stopped sending; outputs show `on_stale`",
    Quality.UNAVAILABLE: "the controller does not have the field, or gave the register to another client",
    Quality.NEVER: "no value yet",
    Quality.FORCED: "the local operator has set the value for commissioning",
    Quality.DIFFERS: "the robot holds something else than it was given",
    Quality.OUT_OF_RANGE: "one of its addresses cannot show the value: there it is saturated, or 0 for NaN",
    Quality.NOT_RUNNING: (
        "it is valid only while the robot program runs, and the program does not; outputs show `on_stale`"
    ),
}
_SOURCES = {
    Source.LOST: "no connection to the controller",
    Source.WAITING: "connected, no package yet",
    Source.FRESH: "packages arrive, in time and with advancing time",
    Source.SILENT: "connected, but no package for longer than `stale_after`",
    Source.FROZEN: "packages arrive, but the controller's own time does not advance",
    Source.LATE: "packages arrive, but their values are older than `stale_after`",
}


def qualities() -> str:
    """The qualities by number."""
    rows = [(quality.value, f"`{quality.name.lower()}`", _QUALITIES[quality]) for quality in Quality]
    return table(("number", "quality", "meaning"), rows)


def sources() -> str:
    """The states of the robot by number."""
    rows = [(source.value, f"`{source.name.lower()}`", _SOURCES[source]) for source in Source]
    return table(("number", "robot_state", "meaning"), rows)


def programs() -> str:
    """The states of the robot program, and which of them count as running."""
    rows = [("0", "not known, or the controller does not report it", "no")]
    rows += [(str(state + 1), name, "yes" if runs else "no") for state, (name, runs) in STATES.items()]
    return table(("number", "program", "runs"), [*rows, ("more", "unknown to this version", "no")])


def refusals() -> str:
    """The reasons of refusals, with the exception codes that stand for them."""
    rows = [
        (reason.value, reason.text, f"{EXCEPTION_OF[reason]:02X}", PRECEDENCE[reason] + 1)
        for reason in Reason
    ]
    return table(("reason", "in words", "exception", "precedence"), rows)


_EXCEPTIONS = {
    ExceptionCode.ILLEGAL_FUNCTION: "a function code that is not served",
    ExceptionCode.ILLEGAL_ADDRESS: "an unmapped address, or this peer may never write it",
    ExceptionCode.ILLEGAL_VALUE: "a malformed request, a value out of limits, or part of a value",
    ExceptionCode.DEVICE_FAILURE: "in place of 0B, where `robot_away: device_failure` says so",
    ExceptionCode.BUSY: "another writer owns it now: try again later",
    ExceptionCode.PATH_UNAVAILABLE: "the controller gave the register to another client, or does not have it",
    ExceptionCode.TARGET_FAILED: (
        "the robot is not connected, its inputs were not adopted yet, the output is stale and its policy is "
        "`exception`, or no such unit is served"
    ),
}


def objections() -> str:
    """The kinds of objections to a reload."""
    return table(("kind", "meaning"), ((f"`{kind}`", meaning) for kind, meaning in MEANINGS.items()))


def exceptions() -> str:
    """The exception codes in use."""
    rows = [(f"{code:02X}", code.text, _EXCEPTIONS[code]) for code in ExceptionCode]
    return table(("code", "name", "when"), rows)


def events() -> str:
    """The events of a cell, with the level that the log gives them."""
    rows = [(f"`{kind.value}`", _level(kind)) for kind in EventKind]
    return table(("event", "level"), rows)


def _level(kind: EventKind) -> str:
    level = LEVELS.get(kind)
    return "info" if level is None else LEVEL_NAMES[level][0]


def metrics() -> str:
    """What /metrics has."""
    rows = [
        (f"`{metric.name}`", metric.kind.value, ", ".join(metric.labels) or "none", metric.meaning)
        for metric in METRICS
    ]
    return table(("name", "type", "labels", "meaning"), rows)


def process_metrics() -> str:
    """What prometheus-client reports of the process."""
    return table(("name", "meaning"), [(f"`{name}`", text) for name, text in PROCESS_METRICS.items()])


def histogram_bounds() -> str:
    """The bounds of the buckets, in milliseconds."""
    return ", ".join(f"{bound * 1000:g}" for bound in BOUNDS) + " ms, and all the rest."


# -- control interface ------------------------------------------------------------------------------------------------

_OBJECTS = {
    "status": "Status",
    "cell": "Cell (`cells` of the status)",
    "link": "Link (`links` of a cell)",
    **{kind.key: f"{kind.title} (`{kind.key}` of a cell)" for kind in kinds()},
    "writer": "Writer (`writers` of a cell)",
    "refusal": "Refusal (`last_refusal` of a cell)",
    "unserved": "Request not served (`last_unserved` of a cell)",
    "variable": "Variable",
    "lock": "Lock",
    "event": "Event",
    "audit": "Record of the audit",
    "version": "Version",
}


def control_fields() -> str:
    """Every field that the control interface answers."""
    return "\n\n".join(
        f"### {_OBJECTS[name]}\n\n"
        + table(("field", "meaning"), ((f"`{field}`", meaning) for field, meaning in fields.items()))
        for name, fields in documented().items()
    )


# -- RTDE -------------------------------------------------------------------------------------------------------------


def rtde_inputs() -> str:
    """What can be written to a controller."""
    return _fields(INPUTS)


def rtde_outputs() -> str:
    """What a controller reports."""
    return _fields(OUTPUTS)


_NUMBERED = re.compile(r"(.*?_)(\d+)")


def _fields(fields: Mapping[str, Field]) -> str:
    rows: list[list[str]] = []
    ranges: list[tuple[str, int, int]] = []
    for name, field in fields.items():
        facts = [field.type.name, field.unit, *(_since(field, series) for series in Series), field.comment]
        numbered = _NUMBERED.fullmatch(name)
        stem, number = (numbered[1], int(numbered[2])) if numbered else (name, -1)
        same = (
            rows
            and numbered
            and rows[-1][1:] == facts
            and ranges[-1][0] == stem
            and ranges[-1][2] + 1 == number
        )
        if same:
            ranges[-1] = (stem, ranges[-1][1], number)
            rows[-1][0] = f"`{stem}{ranges[-1][1]}..{number}`"
        else:
            ranges.append((stem, number, number))
            rows.append([f"`{name}`", *facts])
    return table(("field", "type", "unit", *(series.word for series in Series), "meaning"), rows)


def _since(field: Field, series: Series) -> str:
    if not field.exists(series):
        return "-"
    first = field.first_version(series)
    return "yes" if first is None else str(first)


# -- architecture -----------------------------------------------------------------------------------------------------


_FOLDERS = (
    "core",
    "rtde",
    "robot",
    "simulator",
    "mapping",
    "mapping/rules",
    "modbus",
    "canopen",
    "canopen/sdo",
    "canopen/pdo",
    "demo",
    "cli",
)
"""Packages in the order in which a reader meets them; others follow by name."""


def modules() -> str:
    """Every module with the first sentence of its docstring, by package."""
    parts = []
    package = ROOT / "gatewayd"
    folders = {path.parent.relative_to(package).as_posix() for path in package.rglob("__init__.py")} - {"."}
    known = [name for name in _FOLDERS if name in folders]
    for folder in ["", *known, *sorted(folders.difference(known))]:
        rows = [(f"`{path.stem}`", _subject(path)) for path in sorted((package / folder).glob("[!_]*.py"))]
        title = (
            f"`gatewayd/{folder}/`: {_subject(package / folder / '__init__.py')}" if folder else "`gatewayd/`"
        )
        parts.append(f"### {title}\n\n" + table(("module", "subject"), rows))
    return "\n\n".join(parts)


def _subject(path: Path) -> str:
    text = ast.get_docstring(ast.parse(path.read_text())) or ""
    return " ".join(text.split("\n\n")[0].split()).removesuffix(".")


def layers() -> str:
    """Who may import whom."""
    allowed = import_module("tests.test_architecture").LAYERS
    rows = [
        (f"`{name}`", ", ".join(f"`{name_}`" for name_ in sorted(may - {name})) or "nothing of ours")
        for name, may in allowed.items()
        if name != "gatewayd"
    ]
    return table(("what", "may import"), rows)


# -- shipped files ----------------------------------------------------------------------------------------------------


def simulator_control() -> str:
    """The commands of the simulator's standard input."""
    text = import_module("gatewayd.simulator.control").__doc__ or ""
    lines = [line.strip() for line in text.splitlines() if line.startswith("    ")]
    return "```text\n" + "\n".join(lines) + "\n```"


def dashboard_results() -> str:
    """What the state `result` of the dashboard server means."""
    return table(("number", "meaning"), [(str(int(result)), words) for result, words in WORDS.items()])


PARTS: dict[str, Callable[[], str]] = {
    "dashboard-results": dashboard_results,
    "objections": objections,
    "mapping-keys": mapping_keys,
    "command-line": command_line,
    "exit-codes": exit_codes,
    "status-header": status_header,
    "status-tables": status_tables,
    "status-devices": status_entries,
    "qualities": qualities,
    "robot-states": sources,
    "programs": programs,
    "refusals": refusals,
    "exceptions": exceptions,
    "events": events,
    "control-fields": control_fields,
    "metrics": metrics,
    "process-metrics": process_metrics,
    "histogram-bounds": histogram_bounds,
    "rtde-inputs": rtde_inputs,
    "rtde-outputs": rtde_outputs,
    "modules": modules,
    "layers": layers,
    "simulator-control": simulator_control,
    **canopen.PARTS,
    **examples.PARTS,
    **{f"rtde-clients-{client}": partial(rtde_client_rows, client) for client in CLIENTS},
}
"""Name of a part -> what makes it."""
