"""The shape of the package: who may import whom, and what every module has to have.

The tables below are the rules; docs/explanation/architecture.md explains them. An exception is a line in a table.
"""

from __future__ import annotations

import ast
import re
import subprocess
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "gatewayd"

LAYERS: dict[str, set[str]] = {
    "gatewayd": set(),
    "loop.threads": set(),
    "loop.clock": set(),
    "core": {"core"},
    "rtde": {"loop.threads", "loop.clock", "rtde", "loop.progress"},
    "robot": {"loop.clock", "core", "logs.records", "mapping.plan", "robot", "rtde"},
    "links.robot.availability": {"core", "links.robot.companions", "rtde"},
    "links.robot.companions": {"core", "links.robot.transfer", "rtde.companions"},
    "links.robot.inputs": {
        "core",
        "links.robot.companions",
        "links.robot.readback",
        "links.robot.transfer",
        "rtde",
    },
    "links.robot.readback": {"core", "links.robot.transfer"},
    "links.robot.transfer": {"core"},
    "simulator": {"rtde", "simulator"},
    "mapping": {
        "canopen.cob_ids",
        "canopen.datatypes",
        "links.canopen_node.plan",
        "core.definition",
        "core.status",
        "mapping",
        "report.printable",
        "rtde.catalogue",
        "rtde.companions",
        "rtde.types",
    },
    "modbus": {"loop.clock", "core", "logs.records", "modbus.codec", "mapping.plan", "modbus"},
    "canopen": {"canopen", "core"},
    "canopen.cob_ids": set(),
    "canopen.datatypes": {"core.definition"},
    "canopen.frame": set(),
    "links.canopen_node.runtime": {"canopen", "loop.clock", "core", "logs.records", "loop.progress"},
    "canopen.pythoncan": {"loop.threads", "canopen", "loop.clock"},
    "canopen.socketcan": {"canopen", "loop.clock"},
    "canopen.supervised": {"canopen", "loop.clock"},
    "links.canopen_node.plan": {"canopen.datatypes", "core.definition"},
    "canopen.sdo": {"canopen.cob_ids", "canopen.datatypes", "canopen.dictionary", "canopen.sdo"},
    "logs.records": {"report.printable"},
    "logs.stream": {"logs.records"},
    "logs.events": {"core", "logs.records"},
    "report.format": set(),
    "report.event_text": {"core", "report.format", "report.printable"},
    "service.audit": {"loop.clock", "core", "report.event_text", "report.printable"},
    "service.audit_file": {"logs.records"},
    "control": {
        "loop.threads",
        "service.audit",
        "loop.clock",
        "control",
        "core",
        "report.format",
        "report.event_text",
        "logs.records",
        "mapping.plan",
        "report.printable",
    },
    "control.client": {"control.paths"},
    "control.documented": set(),
    "control.paths": set(),
    "service.liveness": set(),
    "service.operator": {"service.audit", "service.audit_file", "loop.clock", "control", "core"},
    "report.summary": {"core", "report.format"},
    "service.watchdog": {
        "loop.clock",
        "core",
        "service.liveness",
        "logs.records",
        "report.summary",
        "service.systemd",
    },
    "service.compilation": {"gatewayd", "mapping.compiled"},
    "report.printable": set(),
    "service.signals": set(),
    "service.reload": {
        "loop.clock",
        "service.compilation",
        "core",
        "logs.records",
        "mapping.compiled",
        "mapping.diagnostics",
        "report.diff",
        "mapping.plan",
        "links.modbus_server.listener",
        "links.robot.runtime",
        "service.startup",
    },
    "service.startup": {
        "service.compilation",
        "logs.records",
        "mapping.compiled",
        "mapping.diagnostics",
        "mapping.plan",
    },
    "web": {
        "loop.clock",
        "control",
        "core",
        "service.daemon",
        "report.event_text",
        "service.liveness",
        "logs.records",
        "mapping.plan",
        "links.modbus_server.listener",
        "report.printable",
        "service.cell_runtime",
        "web",
    },
    "web.health": {"core"},
    "web.histogram": set(),
    "web.picture": {"core", "report.format", "web.health"},
    "service.systemd": {"report.printable"},
    "loop.progress": {"loop.clock"},
    "demo": {
        "loop.clock",
        "core",
        "service.daemon",
        "demo",
        "logs.events",
        "report.format",
        "report.event_text",
        "logs.records",
        "mapping",
        "modbus",
        "report.printable",
        "rtde",
        "simulator",
    },
    "cli": {
        "cli",
        "loop.clock",
        "service.compilation",
        "control",
        "core",
        "service.daemon",
        "demo",
        "logs.events",
        "report.format",
        "logs.records",
        "logs.stream",
        "mapping",
        "service.operator",
        "report.printable",
        "service.reload",
        "rtde",
        "service.watchdog",
        "service.signals",
        "simulator",
        "service.startup",
        "web.launch",
        "service.systemd",
    },
    "service.daemon": {
        "loop.clock",
        "core",
        "logs.events",
        "logs.records",
        "mapping.plan",
        "modbus",
        "service.cell_runtime",
        "loop.progress",
    },
    "service.cell_runtime": {"canopen", "core", "logs.events", "mapping.plan", "robot"},
    "cli.export": {
        "canopen.dictionary",
        "links.canopen_node.eds",
        "canopen.importer",
        "links.canopen_node.plan",
        "mapping",
        "report.printable",
    },
    "__main__": {"cli", "report.printable", "service.signals"},
}
"""Module or package -> what it and everything in it may import; the longest name that fits decides."""

LIBRARIES: dict[str, set[str]] = {
    "aiohttp": {"control.server", "web.guard", "web.listener"},
    "can": {"canopen.pythoncan", "demo.master"},
    "canopen": {"canopen.importer"},
    "click": {"__main__", "cli"},
    "prometheus_client": {"web.metrics"},
    "pydantic": {"mapping"},
    "pydantic_core": {"mapping"},
    "pymodbus": {"demo", "links.modbus_server.listener"},
    "rich": {"cli", "demo", "report.table"},
    "ruamel": {"mapping.source"},
}
"""Third-party package -> the only modules or packages that may know its types."""

PURE = (
    "control.api",
    "control.documented",
    "control.views",
    "canopen.clock",
    "canopen.cob_ids",
    "links.canopen_node.communication_errors",
    "canopen.datatypes",
    "canopen.dictionary",
    "links.canopen_node.eds",
    "canopen.emergency",
    "canopen.errors",
    "canopen.frame",
    "canopen.gap",
    "canopen.guarding",
    "canopen.heartbeat",
    "canopen.identity",
    "canopen.lss",
    "canopen.nmt",
    "links.canopen_node.node",
    "links.canopen_node.pdo",
    "links.canopen_node.observer",
    "links.canopen_node.peers",
    "links.canopen_node.plan",
    "links.canopen_node.promise",
    "canopen.queue",
    "links.canopen_node.robot_errors",
    "canopen.sdo",
    "links.canopen_node.status_objects",
    "links.canopen_node.storage",
    "canopen.supervision",
    "canopen.sync",
    "links.canopen_node.variables",
    "core",
    "report.format",
    "report.event_text",
    "service.liveness",
    "mapping",
    "modbus.frames",
    "links.modbus_server.functions",
    "links.modbus_server.registers",
    "report.printable",
    "links.robot.availability",
    "links.robot.companions",
    "links.robot.inputs",
    "links.robot.readback",
    "links.robot.transfer",
    "rtde.catalogue",
    "rtde.claims",
    "rtde.codec",
    "rtde.companions",
    "rtde.fields",
    "rtde.lists",
    "rtde.negotiation",
    "rtde.pace",
    "rtde.payloads",
    "rtde.reading",
    "rtde.recipe",
    "rtde.session",
    "report.summary",
    "web.health",
    "web.histogram",
    "web.picture",
)
"""What has no socket, no event loop and no clock."""
OTHER_CLOCK = {
    "cli.watch": "paints a terminal; times of the gateway come as ages",
    "loop.clock": "is made of it",
    "service.compilation": "waits for a child, which is suspended as well",
    "service.watchdog": "the service manager compares it with its own CLOCK_MONOTONIC",
}
"""Module -> why it may ask `time.monotonic`."""

IMPURE_IMPORTS = {"asyncio", "select", "selectors", "signal", "socket", "subprocess", "threading", "time"}

GREATEST_LENGTH = 500
"""Lines of a module."""

WITHOUT_TEST_FILE: dict[str, str] = {
    "gatewayd": "the version",
    "__main__": "tests/cli/test_main.py tests it as a process",
    "canopen": "a docstring",
    "canopen.frame": "records; tests/canopen/test_socketcan.py pins them byte by byte",
    "links.canopen_node.observer": "counters, and calls that do nothing by themselves; tests/links/canopen_node/test_node.py",
    "links.canopen_node.pdo": "a docstring",
    "cli": "tests/cli/test_main.py",
    "cli.completion": "tests/cli/test_main.py",
    "control": "a docstring",
    "core": "a docstring",
    "core.requester": "a record; tests/core/test_cell.py pins what its parts mean",
    "mapping": "a docstring",
    "mapping.plan": "records; tests/mapping/test_compile.py pins their content",
    "mapping.section": "three settings; tests/mapping/test_model.py pins what they do",
    "modbus": "a docstring",
    "robot": "a docstring",
    "rtde": "a docstring",
    "rtde.messages": "records; tests/rtde/test_codec.py pins them byte by byte",
    "rtde.types": "records; tests/rtde/test_recipe.py pins their formats",
    "simulator": "a docstring",
    "web": "a docstring",
}
"""Module -> why it has no test file of its own."""

TESTED_TOGETHER = {"mapping.rules": "tests/mapping/test_rules.py"}
"""Package -> the one file that tests all its modules: rules are tested by their own bad and good examples."""

WITHOUT_ALL = {
    "control",
    "core",
    "mapping",
    "canopen",
    "links.canopen_node.pdo",
    "demo",
    "mapping.rules",
    "modbus",
    "robot",
    "rtde",
    "simulator",
    "web",
}
"""Packages that export nothing themselves."""


def _modules() -> dict[str, Path]:
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        found[".".join(part for part in parts if part != "__init__") or "gatewayd"] = path
    return found


MODULES = _modules()
every_module = pytest.mark.parametrize("module", MODULES)


@cache
def tree(module: str) -> ast.Module:
    """The parsed source."""
    return ast.parse(MODULES[module].read_text())


def imports(module: str) -> Iterator[str]:
    """Full names of everything that is imported anywhere in the module, under TYPE_CHECKING and in functions too."""
    for node in ast.walk(tree(module)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module}: relative import, line {node.lineno}"
            assert node.module is not None
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                yield inner if inner.removeprefix("gatewayd.") in MODULES else node.module


def within(name: str, prefixes: set[str] | tuple[str, ...]) -> bool:
    """Whether `name` is one of the modules or packages, or lies in one."""
    return any(name == prefix or name.startswith(prefix + ".") for prefix in prefixes)


def own_imports(module: str) -> Iterator[str]:
    """Modules of ours that the module imports, without the package itself, which has only the version."""
    for name in imports(module):
        if name.startswith("gatewayd."):
            yield name.removeprefix("gatewayd.")


@every_module
def test_imports_follow_the_layers(module: str) -> None:
    layer = max((name for name in LAYERS if within(module, {name})), key=len, default=None)
    assert layer is not None, f"{module} belongs to no layer: give it one in LAYERS"
    foreign = [name for name in own_imports(module) if not within(name, LAYERS[layer])]
    assert not foreign, f"{module} (layer {layer}) may not import {foreign}"


@every_module
def test_library_types_stay_in_their_adapter(module: str) -> None:
    for name in imports(module):
        library = name.partition(".")[0]
        if library in LIBRARIES:
            assert within(module, LIBRARIES[library]), f"{module} may not import {library}"


@every_module
def test_pure_modules_have_no_socket_no_loop_and_no_clock(module: str) -> None:
    if within(module, PURE):
        assert not IMPURE_IMPORTS & {name.partition(".")[0] for name in imports(module)}


@every_module
def test_whoever_meets_times_of_a_cell_asks_the_one_clock(module: str) -> None:
    """CLOCK_MONOTONIC stands still while the machine is suspended, and the times of a cell go on."""
    asked = [node for node in ast.walk(tree(module)) if isinstance(node, ast.Attribute | ast.Name)]
    names = {ast.unparse(node) for node in asked}
    assert ("time.monotonic" in names) == (module in OTHER_CLOCK)


@every_module
def test_nobody_imports_in_a_circle(module: str) -> None:
    seen: set[str] = set()
    waiting = set(own_imports(module))
    while waiting:
        name = waiting.pop()
        assert name != module, f"{module} imports itself by way of others"
        if name in MODULES and name not in seen:
            seen.add(name)
            waiting |= set(own_imports(name))


@every_module
def test_module_says_what_it_is(module: str) -> None:
    assert ast.get_docstring(tree(module)), f"{module} has no docstring"


@every_module
def test_module_says_what_it_exports(module: str) -> None:
    """`__all__` stands in every module that has something, and names only what is there."""
    if module in WITHOUT_ALL:
        return
    found = [
        ast.literal_eval(node.value)
        for node in tree(module).body
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None
        if "__all__" in map(ast.unparse, node.targets if isinstance(node, ast.Assign) else [node.target])
    ]
    assert found, f"{module} has no __all__"
    assert len(found[0]) == len(set(found[0]))


@every_module
def test_module_is_short_enough_to_be_read(module: str) -> None:
    lines = len(MODULES[module].read_text().splitlines())
    assert lines <= GREATEST_LENGTH, f"{module} has {lines} lines"


def file_of_tests(module: str) -> Path:
    """Where the module's tests belong."""
    *folders, name = module.split(".")
    return ROOT.joinpath("tests", *folders, f"test_{name}.py")


@every_module
def test_module_has_its_test_file(module: str) -> None:
    together = [file for package, file in TESTED_TOGETHER.items() if within(module, {package})]
    if together:
        assert (ROOT / together[0]).exists()
    elif module in WITHOUT_TEST_FILE:
        assert not file_of_tests(module).exists(), (
            f"{module} has a test file now: strike it from WITHOUT_TEST_FILE"
        )
    else:
        assert file_of_tests(module).exists(), f"{file_of_tests(module).relative_to(ROOT)} is missing"


def test_tables_name_only_what_exists() -> None:
    """No rule outlives the module that it is about."""
    named = (
        set(LAYERS)
        | set(PURE)
        | set(WITHOUT_TEST_FILE)
        | set(TESTED_TOGETHER)
        | set.union(*LIBRARIES.values())
    )
    assert named - set(MODULES) == set()


FORBIDDEN = {
    "a path of somebody's machine": re.compile(r"(?<![\w.\-/])/(?:root|home/\w+|work|tmp/\w+)/"),
    "the host of a package index": re.compile(
        r"\b(?:[\w-]+\.)+[a-z]{2,}/(?:simple|pypi)\b|--(?:extra-)?index-url[ =]http"
    ),
    "a key or password": re.compile(r"-----BEGIN [A-Z ]*PRIVATE KEY|\bAKIA[0-9A-Z]{16}\b"),
}
"""What no committed file may contain."""


def test_no_file_names_a_machine_or_an_index() -> None:
    listed = subprocess.run(
        ["git", "-C", ROOT, "ls-files", "-z"], capture_output=True, text=True, check=False
    )
    if listed.returncode != 0:
        pytest.skip("this tree is not a git checkout")
    for name in filter(None, listed.stdout.split("\0")):
        path = ROOT / name
        if name == "tests/test_architecture.py" or not path.is_file():
            continue
        text = path.read_text(errors="replace")
        for what, pattern in FORBIDDEN.items():
            match = pattern.search(text)
            assert match is None, f"{name} names {what}: {match.group()!r}"
