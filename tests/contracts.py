"""What others rely on, read from the code as plain values: the one place that knows where each of it lives now.

`tests/test_contracts.py` holds every function here to its file in `tests/golden/contracts`. What moves is imported from
its new place here; the files stay as they are. A change of a contract is a change of its file (`python -m
tests.contracts` writes them anew), and goes into the changelog.
"""

from __future__ import annotations

import ast
import json
import logging
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import chdir
from hashlib import sha256
from itertools import chain
from pathlib import Path
from typing import Any
from unittest.mock import MagicMock

import click
from click.testing import CliRunner, Result

from gatewayd.cli import COMMANDS
from gatewayd.cli import command as root_command
from gatewayd.control.server import application
from gatewayd.core.cell import Cell
from gatewayd.core.definition import CellDefinition, Direction, Fallback, Lock, ValueKind, Variable, Writer
from gatewayd.core.events import Event, EventKind
from gatewayd.core.freshness import Source
from gatewayd.core.image import Quality
from gatewayd.core.refusal import PRECEDENCE, Reason, Refusal
from gatewayd.core.requester import Requester
from gatewayd.core.status import StatusBlock
from gatewayd.core.status_layout import BASE, HEADER_WORDS, LENGTH, TABLES
from gatewayd.links.canopen_node.status_objects import StatusObjects
from gatewayd.links.registry import status_fields, status_tables
from gatewayd.logs.events import EventLog
from gatewayd.logs.records import Format, configure
from gatewayd.mapping.diagnostics import Diagnostic, Rule
from gatewayd.mapping.loader import load, load_together
from gatewayd.mapping.rules import catalogue
from gatewayd.mapping.schema import mapping_schema
from gatewayd.report.schema import documented
from gatewayd.web.access_control import AccessControl
from gatewayd.web.listener import StatusListener
from gatewayd.web.metrics import METRICS, PROCESS_METRICS
from gatewayd.web.settings import settings
from tests.sources import MODULES, PACKAGE, ROOT, every_node, nodes

GOLDEN = ROOT / "tests" / "golden" / "contracts"


# -- mapping language -------------------------------------------------------------------------------------------------


def rules() -> object:
    """Every rule of `check`."""
    return {
        rule.id: {"slug": rule.slug, "severity": rule.severity.value, "summary": rule.summary}
        for rule in catalogue.complete()
    }


def rule_home(rule: Rule) -> Path:
    """The folder of a rule's examples."""
    return ROOT.joinpath(*rule.home.split("."), rule.folder)


def findings() -> object:
    """What `check` says of each rule's bad examples."""
    return {
        rule.id: [_finding(diagnostic) for diagnostic in _check_bad(rule)] for rule in catalogue.complete()
    }


def _check_bad(rule: Rule) -> Iterator[Diagnostic]:
    paths = sorted(rule_home(rule).glob("bad*.yaml"), key=lambda path: path.stem)
    with chdir(rule_home(rule)):  # files beside a mapping are found from where it is
        checked = load_together([(path.name, path.read_bytes()) for path in paths])
    for loaded in checked:
        yield from loaded.diagnostics


def _finding(found: Diagnostic) -> list[str | None]:
    related = [f"{place.position}: {place.message}" for place in found.related]
    return [found.rule.id, str(found.position), found.message, found.hint, *related]


def language() -> object:
    """Every key of a mapping file by the path that leads there, whatever the models behind it are called."""
    schema = mapping_schema()
    return dict(_keys(schema, schema["$defs"], ""))


def _keys(section: Mapping[str, Any], named: Mapping[str, Any], path: str) -> Iterator[tuple[str, object]]:
    for key, value in section.get("properties", {}).items():
        inner, here = _resolved(value, named), f"{path}.{key}".strip(".")
        yield (
            here,
            {
                "description": inner.get("description"),
                "default": inner.get("default"),
                "required": key in section.get("required", ()),
                "form": _form(inner, named),
            },
        )
        for choice in inner.get("anyOf", [inner]):
            yield from _eachs(_resolved(choice, named), named, here)


def _eachs(choice: Mapping[str, Any], named: Mapping[str, Any], path: str) -> Iterator[tuple[str, object]]:
    yield from _keys(choice, named, path)
    for value in choice.get("patternProperties", {}).values():
        yield from _keys(_resolved(value, named), named, f"{path}.*")
    if isinstance(choice.get("additionalProperties"), dict):
        yield from _keys(_resolved(choice["additionalProperties"], named), named, f"{path}.*")
    if "items" in choice:
        yield from _keys(_resolved(choice["items"], named), named, f"{path}[]")


def _resolved(schema: Mapping[str, Any], named: Mapping[str, Any]) -> Mapping[str, Any]:
    if "$ref" not in schema:
        return schema
    return {**named[schema["$ref"].rpartition("/")[2]], **{k: v for k, v in schema.items() if k != "$ref"}}


def _form(schema: Mapping[str, Any], named: Mapping[str, Any]) -> object:
    """What may stand there, without the keys of sections, which have their own lines."""
    schema = _resolved(schema, named)
    left_out = {"description", "default", "properties", "required", "title", "additionalProperties"}
    found: dict[str, object] = {}
    for key, value in schema.items():
        if key == "anyOf":
            found[key] = sorted((_form(choice, named) for choice in value), key=json.dumps)
        elif key == "items":
            found[key] = _form(value, named)
        elif key == "patternProperties":
            found[key] = {pattern: _form(inner, named) for pattern, inner in value.items()}
        elif key not in left_out:
            found[key] = value
    if isinstance(schema.get("additionalProperties"), dict):
        found["additionalProperties"] = _form(schema["additionalProperties"], named)
    return found


MAPPINGS = [*sorted(ROOT.glob("mappings/*.yaml")), PACKAGE / "demo" / "demo.yaml"]


FORMS = {
    "text": ("show",),
    "text, all": ("show", "--all"),
    "csv": ("show", "--format", "csv"),
    "json": ("show", "--format", "json"),
    "markdown": ("show", "--format", "markdown"),
}
EXPORTS = ("eds", "dcf", "urscript")


def mappings() -> object:
    """What the shipped mappings come to: fingerprint, register list, exports (as hashes)."""
    return {path.name: _mapping(str(path.relative_to(ROOT))) for path in MAPPINGS}


def _mapping(file: str) -> dict[str, object]:
    printed = {form: _printed(*arguments, file) for form, arguments in FORMS.items()}
    shown = json.loads(printed["json"].stdout)
    return {
        "fingerprint": shown["fingerprint"],
        "show": {form: _hash(result) for form, result in printed.items()},
        "json": sorted(set(_paths(shown))),
        **{form: _hash(_printed("export", form, file)) for form in EXPORTS},
    }


def _printed(*arguments: str) -> Result:
    with chdir(ROOT):
        return CliRunner(env={"COLUMNS": "140"}).invoke(root_command, arguments)


def _hash(result: Result) -> str:
    digest = sha256(result.output.encode()).hexdigest()[:16]
    return digest if result.exit_code == 0 else f"exit code {result.exit_code}, {digest}"


def _paths(value: object, path: str = "") -> Iterator[str]:
    """The keys of a document: `variables[].modbus[].area`."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield f"{path}.{key}".lstrip(".")
            yield from _paths(inner, f"{path}.{key}".lstrip("."))
    elif isinstance(value, list):
        for inner in value:
            yield from _paths(inner, f"{path}[]")


_DOCUMENTED = re.compile(r"```yaml\n(gatewayd: 1\n.*?)```", re.DOTALL)


def documented_mappings() -> object:
    """The fingerprint of every whole mapping in the documentation."""
    found = {}
    for page in sorted((ROOT / "docs").rglob("*.md")):
        for number, text in enumerate(_DOCUMENTED.findall(page.read_text())):
            plan = load(text.encode(), page.name).plan
            if plan is not None:
                found[f"{page.stem} {number}"] = f"{plan.cell.fingerprint:08X}"
    return found


# -- status block -----------------------------------------------------------------------------------------------------


FIGURES: Mapping[str, object] = {
    "started": -100_000.5,
    "heartbeat": 0x1_2345,
    "packages": 1_000_001,
    "skipped": 1_000_002,
    "late": 1_000_003,
    "frequency": 499.94,
    "sessions": 17,
    "read_back_mismatches": 1_000_004,
    "unadopted": 3,
    "differing": 4,
    "lag": 0.0125,
    "adoption": 7.2,
    "program": 2,
    "gaps": 5,
    "watchdog_fed": True,
    "writes_accepted": 1_000_005,
    "writes_refused": 1_000_006,
    "words": {"modbus_connections": 6, "can_bus": 5, "nmt_state": 127},
}
"""A value for every figure of a cell's header."""


def cell_with_every_figure() -> Cell:
    """A cell at time 10.0 of whose header no word that can be set is 0."""
    word = "input_bit_registers0_to_31"
    cell = Cell(
        CellDefinition(
            name="press",
            fingerprint=0xC0FFEE42,
            variables=(
                Variable(1, "start", Direction.INPUT, ValueKind.BOOL, word, bit=0, lock=0),
                Variable(
                    2, "cycles", Direction.OUTPUT, ValueKind.INT, "output_int_register_0", on_stale=Fallback()
                ),
            ),
            locks=(Lock("start", (0,), (0, 1), lease=5.0),),
            writers=(Writer("plc"), Writer("hmi")),
            stale_after=0.1,
        )
    )
    cell.robot_connected(1.0)
    cell.adopt({0: False}, 1.0)
    cell.package_arrived(9.95, 9.95)
    plc = Requester(0, connection=1)
    cell.writer_connected(plc, 2.0)
    assert cell.request(plc, 0, 6.0) is None
    cell.refuse(Requester(1), Refusal(Reason.HELD, 0, 0), 9.0)
    set_figures(cell, FIGURES)
    return cell


def set_figures(cell: Cell, figures: Mapping[str, object]) -> None:
    """Put the figures where the status block takes them from."""
    for name, value in figures.items():
        setattr(cell.health, name, value)


def status_block() -> object:
    """Where what lies, and the bytes of a header."""
    header = StatusBlock(cell_with_every_figure(), status_fields()).read(0, HEADER_WORDS, 10.0)
    return [
        f"{BASE}, {LENGTH} words",
        *([field.offset, field.words, field.name, field.meaning] for field in status_fields()),
        *([table.offset, table.words, table.name, table.meaning] for table in (*TABLES, *status_tables())),
        *(header[at : at + 16].hex(" ", 2) for at in range(0, len(header), 16)),
    ]


def status_objects() -> object:
    """The status block in the object dictionary."""
    nobody = Requester(None)
    found = StatusObjects(cell_with_every_figure(), lambda: 10.0, lambda: nobody, lambda: nobody)
    return {
        f"{item.index:04X}": [
            [entry.subindex, entry.name, entry.type.name, entry.access.name, entry.pdo.name]
            for entry in item.entries
        ]
        for item in found.objects()
    }


def numbers() -> object:
    """What stands in the status block, and is said in words elsewhere."""
    return {
        "events": [kind.value for kind in EventKind],
        "reasons": {reason.name: [reason.value, reason.text, PRECEDENCE[reason]] for reason in Reason},
        "qualities": {quality.name: quality.value for quality in Quality},
        "sources": {source.name: source.value for source in Source},
    }


# -- interfaces -------------------------------------------------------------------------------------------------------


def metrics() -> object:
    """What /metrics has."""
    found: dict[str, object] = {metric.name: [metric.kind.value, *metric.labels] for metric in METRICS}
    return found | dict.fromkeys(PROCESS_METRICS, "process")


def control() -> object:
    """Fields and routes of the control interface, and the routes of the status listener."""
    anything = MagicMock()
    listener = StatusListener(AccessControl(settings("127.0.0.1:0")), anything, api=(anything, None))
    return {
        "fields": {name.upper(): list(fields) for name, fields in documented().items()},
        "socket": sorted(_routes(application(anything, None))),
        "listener": sorted(_routes(listener._app)),
    }


def _routes(application: Any) -> Iterator[str]:
    for route in application.router.routes():
        if route.method != "HEAD":
            yield f"{route.method} {route.resource.canonical}"


def commands() -> object:
    """Every command with what it takes and its exit codes."""
    context = click.Context(root_command)
    found: dict[str, click.Command] = {"": root_command}
    for name in COMMANDS:
        command = root_command.get_command(context, name)
        assert command is not None
        found[name] = command
        if isinstance(command, click.Group):
            inner = {each: command.get_command(context, each) for each in command.list_commands(context)}
            found |= {f"{name} {each}": made for each, made in inner.items() if made is not None}
    return {f"gatewayd {name}".strip(): _command(command) for name, command in found.items()}


def _command(command: click.Command) -> object:
    epilog = (command.epilog or "").partition("Exit codes:\n")[2]
    return {
        "parameters": [_parameter(parameter) for parameter in command.params],
        "exit codes": re.findall(r"^ +(\d+) +\S", epilog, re.MULTILINE),
    }


def _parameter(parameter: click.Parameter) -> str:
    kind = parameter.type
    words = [
        parameter.param_type_name,
        "/".join([*parameter.opts, *parameter.secondary_opts]),
        "|".join(map(str, kind.choices)) if isinstance(kind, click.Choice) else kind.name,
        *(["required"] if parameter.required else []),
        *(["multiple"] if getattr(parameter, "multiple", False) or parameter.nargs == -1 else []),
        *(["flag"] if getattr(parameter, "is_flag", False) else []),
        *([str(parameter.envvar)] if parameter.envvar else []),
    ]
    return " ".join(words)


def environment() -> object:
    """Every environment variable that is looked at."""
    return sorted({name for node in every_node() for name in _variables(node)})


_OURS = re.compile(r"_?GATEWAYD_[A-Z_]+")


def _variables(node: ast.AST) -> Iterator[str]:
    asked: ast.expr | None = None
    match node:
        case ast.Constant(str(value)) if _OURS.fullmatch(value):
            yield value
        case ast.Call(ast.Attribute(where, "get"), [name, *_]) if _is_environment(where):
            asked = name
        case ast.Subscript(where, name) if _is_environment(where):
            asked = name
        case ast.Compare(name, _, [where, *_]) if _is_environment(where):
            asked = name
    if isinstance(asked, ast.Constant):
        yield str(asked.value)


def _is_environment(node: ast.expr) -> bool:
    return _last_name(node).endswith(("environ", "environment"))


def _last_name(node: ast.expr) -> str:
    """Of `a.b.c` it is `c`."""
    match node:
        case ast.Attribute(_, name) | ast.Name(name):
            return name
    return ""


# -- log --------------------------------------------------------------------------------------------------------------

_METHODS = {"debug", "info", "warning", "error", "exception", "critical", "log"}
Function = ast.FunctionDef | ast.AsyncFunctionDef


def log_calls(sources: Mapping[str, Sequence[ast.AST]] | None = None) -> dict[str, list[str]]:
    """What the log may say apart from events: text -> its levels and the names of its fields, by its call.

    A text that a function is handed is found where that function is called. What no constant says (a finding, the text
    of an error) has the name of its module in place of its text.
    """
    sources = sources or {module: nodes(module) for module in MODULES}
    found: dict[str, set[str]] = {}
    for module, inside in sources.items():
        for call in filter(_is_logging, inside):
            assert isinstance(call, ast.Call)
            said = f"{_level(call)} {_fields(call, inside)}".strip()
            for text in _texts(call, inside, sources) or {f"(computed in {module})"}:
                found.setdefault(text, set()).add(said)
    return {text: sorted(calls) for text, calls in found.items()}


def _is_logging(node: ast.AST) -> bool:
    match node:
        case ast.Call(ast.Attribute(ast.Call(ast.Attribute(_, "getLogger")), method), [_, *_]):
            return method in _METHODS
        case ast.Call(ast.Attribute(logger, method), [_, *_]):
            return method in _METHODS and _last_name(logger).lstrip("_") in ("log", "logger")
    return False


def _texts(call: ast.Call, inside: Sequence[ast.AST], sources: Mapping[str, Sequence[ast.AST]]) -> set[str]:
    """What a call may say: its constant, or what is handed to the function around it; empty where neither is there."""
    text = call.args[1] if _method(call) == "log" else call.args[0]
    if isinstance(text, ast.Constant) and text.value != "%s":
        return {str(text.value)}
    around = (node for node in inside if isinstance(node, Function) and call in ast.walk(node))
    handed = (_handed(function, text.id, sources) for function in around if isinstance(text, ast.Name))
    return set().union(*handed)


def _handed(function: Function, name: str, sources: Mapping[str, Sequence[ast.AST]]) -> Iterator[str]:
    """The constants that calls of a function give to one of its parameters, by name or place, or its default."""
    parameters = [parameter.arg for parameter in function.args.args]
    if name not in parameters:
        return
    default = dict(zip(reversed(parameters), reversed(function.args.defaults), strict=False)).get(name)
    at = parameters.index(name) - (parameters[0] == "self")
    for node in (node for inside in sources.values() for node in inside):
        if isinstance(node, ast.Call) and _last_name(node.func) == function.name:
            by_place = node.args[at] if at < len(node.args) else default
            given = next((keyword.value for keyword in node.keywords if keyword.arg == name), by_place)
            if isinstance(given, ast.Constant):
                yield str(given.value)


def _method(call: ast.Call) -> str:
    assert isinstance(call.func, ast.Attribute)
    return call.func.attr


def _level(call: ast.Call) -> str:
    """The level by name, several where an expression chooses; `log` where it comes from elsewhere."""
    if any(keyword.arg == "exc_info" for keyword in call.keywords):
        return "exception"
    chosen = [node.attr for node in ast.walk(call.args[0]) if isinstance(node, ast.Attribute)]
    return "/".join(sorted(name.lower() for name in chosen if name.isupper())) or _method(call)


def _fields(call: ast.Call, module: Sequence[ast.AST]) -> str:
    names: list[str] = []
    for keyword in call.keywords:
        if keyword.arg == "extra":
            for field in _made(keyword.value, module).keywords:
                names += [field.arg] if field.arg is not None else _returned(field.value, module)
    return " ".join(sorted(names))


def _made(extra: ast.expr, module: Sequence[ast.AST]) -> ast.Call:
    """The call that makes the fields, there or in the line that gives them their name."""
    if isinstance(extra, ast.Name):
        lines = (node for node in module if isinstance(node, ast.Assign))
        extra = next(line.value for line in lines if ast.unparse(line.targets[0]) == extra.id)
    assert isinstance(extra, ast.Call)
    return extra


def _returned(call: ast.expr, module: Sequence[ast.AST]) -> list[str]:
    """The keys of what a function returns, of the same module or of a base elsewhere; `...`: they cannot be seen."""
    name = ast.unparse(call).removesuffix("()").rpartition(".")[2]
    for node in chain(module, every_node()):
        if isinstance(node, ast.FunctionDef) and node.name == name:
            for inner in ast.walk(node):
                if isinstance(inner, ast.Return) and isinstance(inner.value, ast.Dict):
                    return [ast.literal_eval(key) for key in inner.value.keys if key is not None]
    return ["..."]


def log_lines() -> object:
    """An event of each kind with everything set, as the log writes it for programs."""
    log = EventLog(cell_with_every_figure())
    root, stream = logging.getLogger(), MagicMock()
    before = root.handlers[:], root.level, logging.raiseExceptions
    try:
        configure(Format.JSON, logging.DEBUG, stream)
        for kind in EventKind:
            for variable, lock in ((0, None), (None, 0)):
                log(Event(3.0, kind, variable, lock, 0, 1, Reason.HELD, False, True, 2, "why", "192.0.2.1"))
    finally:
        root.handlers[:], level, logging.raiseExceptions = before
        root.setLevel(level)
    lines = [json.loads(call.args[0]) for call in stream.write.call_args_list]
    return [{name: value for name, value in line.items() if name != "time"} for line in lines]


def as_text(contract: object) -> str:
    """As a golden file holds it: sorted, an element a line."""
    if isinstance(contract, dict):
        lines = [f"{_compact(str(key))}: {_compact(contract[key])}" for key in sorted(contract)]
        return "{\n" + ",\n".join(lines) + "\n}\n"
    assert isinstance(contract, list)
    return "[\n" + ",\n".join(map(_compact, contract)) + "\n]\n"


def _compact(value: object) -> str:
    return json.dumps(value, ensure_ascii=False, sort_keys=True)


CONTRACTS: Mapping[str, Callable[[], object]] = {
    "rules": rules,
    "findings": findings,
    "language": language,
    "mappings": mappings,
    "documented-mappings": documented_mappings,
    "status-block": status_block,
    "status-objects": status_objects,
    "numbers": numbers,
    "metrics": metrics,
    "control": control,
    "commands": commands,
    "environment": environment,
    "log-calls": log_calls,
    "log-lines": log_lines,
}
"""Name of the golden file -> what has to be the same."""


if __name__ == "__main__":
    for name, read in CONTRACTS.items():
        (GOLDEN / f"{name}.json").write_text(as_text(read()))
