"""The shape of the package: who may import whom, and what every module has to have.

The tables below are the rules; docs/explanation/architecture.md explains them. An exception is a line in a table. Every
test reports all that break its rule.
"""

from __future__ import annotations

import ast
import re
import subprocess
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

import pytest

from tests.sources import MODULES, ROOT, nodes, tree

LINK = {
    "core",
    "links.access",
    "links.contract",
    "links.examination",
    "links.exports",
    "links.language",
    "links.proposals",
    "links.registry",
    "links.route",
    "links.tables",
    "logs.records",
    "loop",
    "machine",
    "mapping",
    "report",
}
"""What a kind of link may import besides itself and the library of its protocol: never another link."""

LAYERS: dict[str, set[str]] = {
    "gatewayd": set(),
    "loop": {"loop"},
    "whole_file": set(),
    "machine": {"loop.resolve", "machine"},
    "core": {"core"},
    "rtde": {"loop", "report.format", "rtde", "whole_file"},
    "rtde.testing": {"simulator"},
    "encoding": {"core.definition", "encoding"},
    "modbus": {"core.definition", "encoding", "modbus"},
    "modbus.client": {"loop", "modbus"},
    "canopen": {"canopen", "core.definition", "loop", "machine.netlink"},
    "dashboard": {"dashboard", "loop"},
    "mqtt": {"loop", "mqtt"},
    "simulator": {"report.format", "rtde", "simulator"},
    "sparkplug": {"sparkplug"},
    "mapping": {
        "core.definition",
        "links.contract",
        "links.language",
        "links.registry",
        "mapping",
        "report.format",
        "report.printable",
        "report.wording",
    },
    "links": set(),
    "links.access": {"core.definition", "links.examination", "mapping.plan"},
    "links.contract": {"core", "links.access", "mapping.plan"},
    "links.examination": {"core.definition", "mapping.plan"},
    "links.language": {"core.definition", "links.can_buses", "links.contract", "mapping"},
    "links.exports": set(),
    "links.robot_program": {"core.definition"},
    "links.proposals": set(),
    "links.route": {"links.examination", "machine"},
    "links.tables": {"mapping.expanded", "mapping.plan", "report.layout"},
    "links.registry": {
        "core.status_layout",
        "links.access",
        "links.contract",
        "links.examination",
        "links.exports",
        "links.language",
        "links.proposals",
        "links.tables",
    },
    "links.robot": {*LINK, "dashboard", "links.robot", "links.robot_program", "rtde"},
    "links.modbus_places": {
        "core.definition",
        "links.modbus_places",
        "mapping",
        "modbus",
        "report.format",
        "report.wording",
    },
    "links.modbus_server": {
        *LINK,
        "links.modbus_places",
        "links.modbus_server",
        "links.robot_program",
        "modbus",
        "plc",
    },
    "links.can_buses": {"canopen.load", "mapping.diagnostics"},
    "links.can_frames": {"canopen.frame"},
    "links.canopen_values": {"canopen", "core.definition", "encoding", "mapping.reach"},
    "links.canopen_node": {
        *LINK,
        "canopen",
        "encoding",
        "links.can_buses",
        "links.can_frames",
        "links.canopen_node",
        "links.canopen_values",
        "plc",
        "whole_file",
    },
    "links.devices": {
        *LINK,
        "canopen",
        "links.can_buses",
        "links.can_frames",
        "links.canopen_values",
        "links.devices",
        "links.modbus_places",
        "modbus",
    },
    "plc": {
        "core",
        "links.exports",
        "mapping.plan",
        "plc",
        "report.format",
        "report.printable",
        "report.wording",
    },
    "links.standby": {*LINK, "links.standby"},
    "links.mqtt": {*LINK, "links.mqtt", "mqtt", "sparkplug", "whole_file"},
    "report": {"core", "links.contract", "links.registry", "mapping", "report"},
    "maptest": {
        "core",
        "mapping.compiled",
        "mapping.diagnostics",
        "mapping.document",
        "mapping.loader",
        "mapping.testing",
        "maptest",
        "report.findings",
        "report.format",
        "report.printable",
    },
    "report.format": set(),
    "report.layout": set(),
    "report.printable": set(),
    "report.wording": set(),
    "logs": {"core", "logs", "loop.clock", "loop.lines", "loop.quota", "report"},
    "audit": {"audit", "core", "logs.records", "loop", "report"},
    "control": {
        "audit.record",
        "audit.trail",
        "control",
        "core",
        "links.access",
        "links.contract",
        "links.registry",
        "logs.records",
        "loop",
        "mapping.plan",
        "report",
    },
    "control.token_file": {"control", "whole_file"},
    "control.client": {"control.paths"},
    "control.paths": set(),
    "control.running": {"control.client", "control.paths", "links.examination"},
    "doctor": {
        "control.running",
        "doctor",
        "links.examination",
        "links.registry",
        "mapping.compiled",
        "mapping.diagnostics",
        "mapping.plan",
        "report",
    },
    "service": {
        "audit",
        "control",
        "core",
        "gatewayd",
        "links.access",
        "links.contract",
        "links.registry",
        "logs",
        "loop",
        "mapping.compiled",
        "mapping.diagnostics",
        "mapping.files",
        "mapping.plan",
        "report",
        "service",
    },
    "service.assemble": {
        "control",
        "core",
        "links.contract",
        "links.registry",
        "logs",
        "loop",
        "mapping.compiled",
        "mapping.plan",
        "report",
        "service",
        "web.access_control",
        "web.launch",
    },
    "service.options": {"web.settings"},
    "service.garbage": set(),
    "service.signals": set(),
    "web.settings": {"report.format"},
    "web": {
        "control",
        "core",
        "links.contract",
        "links.registry",
        "logs.records",
        "loop",
        "machine.certificates",
        "mapping.plan",
        "report",
        "service",
        "web",
    },
    "web.histogram": set(),
    "demo": {
        "audit.record",
        "core",
        "demo",
        "links.contract",
        "links.registry",
        "logs",
        "loop",
        "mapping",
        "modbus",
        "report",
        "rtde",
        "service",
        "simulator",
    },
    "cli": {
        "cli",
        "control",
        "core",
        "demo",
        "doctor",
        "links.access",
        "links.contract",
        "links.examination",
        "links.exports",
        "links.language",
        "links.proposals",
        "links.registry",
        "logs",
        "loop",
        "machine",
        "mapping",
        "maptest",
        "report",
        "rtde",
        "service",
        "simulator",
        "web.settings",
        "whole_file",
    },
    "__main__": {
        "cli",
        "report.printable",
        "service.compilation",
        "service.garbage",
        "service.signals",
        "service.standard_streams",
    },
}
"""Module or package -> what it and everything in it may import; the longest name that fits decides."""

LIBRARIES: dict[str, set[str]] = {
    "arro3": {"rtde.recording"},
    "aiohttp": {"control.http_log", "control.server", "web.doors", "web.guard", "web.listener"},
    "can": {"canopen.pythoncan", "demo.master"},
    "canopen": {"canopen.importer", "canopen.manager.data_sheet"},
    "click": {"__main__", "cli"},
    "matplotlib": {"cli.rtde"},
    "numpy": {"cli.rtde", "rtde.recording"},
    "prometheus_client": {"web.metrics"},
    "pymodbus": {"demo.plc", "modbus.client.pdus"},
    "pytest": {"rtde.testing"},
    "rich": {"cli", "demo", "report.screen"},
    "ruamel": {"mapping.source"},
    "serial": {"modbus.client.serial"},
}
"""Third-party package -> the only modules or packages that may know its types."""

PURE = (
    "canopen",
    "control",
    "core",
    "dashboard",
    "doctor",
    "links",
    "mapping",
    "maptest",
    "modbus",
    "mqtt",
    "plc",
    "report",
    "rtde",
    "sparkplug",
    "web",
)
"""Packages without socket, event loop and clock: time is a parameter."""

IMPURE = {
    "canopen.interface": "asks a CAN interface for its state",
    "canopen.manager.direct": "has the bus and a timer",
    "canopen.manager.runtime": "has the bus and the timer",
    "canopen.pythoncan": "a driver",
    "canopen.socketcan": "a driver",
    "canopen.supervised": "a driver",
    "control.client": "has the socket",
    "control.endpoint": "has the socket",
    "control.server": "speaks HTTP",
    "dashboard.client": "has the socket",
    "links.canopen_node.doctor": "hears the bus",
    "links.canopen_node.runtime": "a link at work",
    "links.canopen_node.store": "has the file, and a task that waits for it",
    "links.devices.modbus.access": "opens a connection",
    "links.devices.modbus.asking": "waits for answers",
    "links.devices.modbus.doctor": "opens a connection",
    "links.devices.runtime": "has the tasks of the families",
    "links.devices.at_work": "keeps connections and buses at work as tasks",
    "links.devices.link": "a link at work",
    "links.devices.modbus.link": "a link at work",
    "links.devices.canopen.access": "opens a bus",
    "links.devices.canopen.link": "a link at work",
    "links.mqtt.brokers": "has the tasks of the connections",
    "links.mqtt.doctor": "opens a connection",
    "links.mqtt.json_link": "tells the time of day",
    "links.mqtt.node": "tells the time of day, and waits for a file",
    "links.mqtt.session": "a connection at work",
    "links.modbus_server.doctor": "waits for a thread",
    "links.modbus_server.connection": "a protocol of asyncio",
    "links.modbus_server.handshakes": "gives them turns of the loop",
    "links.modbus_server.listener": "has the sockets",
    "links.modbus_server.listeners": "opens listeners",
    "links.modbus_server.polling": "has the sockets",
    "links.modbus_server.renewal": "waits for threads",
    "links.modbus_server.rules.certificates": "compares dates of files",
    "links.modbus_server.runtime": "a link at work",
    "links.modbus_server.secure_connection": "compares the date of a certificate",
    "links.modbus_server.sockets": "has the sockets",
    "links.modbus_server.trust_findings": "writes dates",
    "links.standby.link": "a link at work",
    "links.robot.dashboard.doctor": "asks the robot",
    "links.robot.dashboard.link": "a link at work",
    "links.robot.doctor": "asks the name service and the robot",
    "links.robot.runtime": "a link at work",
    "modbus.client.runner": "has a connection and timers",
    "modbus.client.serial": "has the port",
    "modbus.client.tcp": "has the socket",
    "mqtt.client": "has the connection as a task",
    "mqtt.connection": "a protocol of asyncio",
    "rtde.api.feed": "waits for what happens",
    "rtde.api.loop_thread": "a loop in a thread",
    "rtde.api.properties": "waits for an answer",
    "rtde.api.robot": "has the client as a task",
    "rtde.api.stream": "an asynchronous iterator",
    "rtde.client": "has the socket",
    "rtde.connection": "has the socket",
    "rtde.loss": "has the socket",
    "rtde.receiving": "has the socket",
    "rtde.sending": "has the transport",
    "rtde.timers": "timers of the loop",
    "rtde.survey": "waits for a controller to notice that a client has gone",
    "rtde.visit": "runs a client",
    "rtde.waiters": "waits for what happens",
    "web.doors": "has the connections",
    "web.encryption": "measures a handshake",
    "web.guard": "speaks HTTP",
    "web.launch": "has the socket",
    "web.listener": "speaks HTTP",
    "web.probes": "measures the loop",
    "web.view": "tells the time of day",
}
"""Module in a pure package -> why it is none."""

OTHER_CLOCK = {
    "cli.rtde.progress_lines": "paces lines of a terminal",
    "cli.standby": "measures a switch for a terminal",
    "cli.watch": "paints a terminal; times of the gateway come as ages",
    "loop.clock": "is made of it",
    "rtde.api.loop_thread": "has the clock of every plain loop",
    "service.compilation": "waits for a child, which is suspended as well",
    "service.watchdog": "the service manager compares it with its own CLOCK_MONOTONIC",
}
"""Module -> why it may ask `time.monotonic`."""

IMPURE_IMPORTS = {"asyncio", "select", "selectors", "signal", "socket", "subprocess", "threading", "time"}

MAX_LENGTH = 500
"""Lines of a module."""

WITHOUT_TEST_FILE: dict[str, str] = {
    "rtde": "names of the API; tests/rtde/test_standing_alone.py",
    "rtde.handler": "a protocol; tests/rtde/test_connection.py",
    "rtde.steps": "records; tests/rtde/test_negotiation.py",
    "service.options": "a record; tests/service/test_main.py",
    "gatewayd": "the version",
    "__main__": "tests/cli/test_main.py tests it as a process",
    "links.proposals": "records and a protocol; tests/links/devices/canopen/test_proposal.py",
    "links.access": "records and a protocol; tests/links/devices/modbus/test_access.py, test_asking.py",
    "canopen.frame": "records; tests/canopen/test_socketcan.py pins them byte by byte",
    "cli": "tests/cli/test_main.py",
    "cli.completion": "tests/cli/test_main.py",
    "cli.importing": "a table; tests/cli/test_main.py",
    "cli.importing.register_list.findings": "records; tests/cli/importing/register_list/test_proposal.py",
    "cli.importing.register_list.mapping": "tests/cli/importing/register_list/test_proposal.py, test_csv.py",
    "cli.importing.register_list.rows": "tests/cli/importing/register_list/test_proposal.py",
    "cli.importing.register_list.variables": "tests/cli/importing/register_list/test_proposal.py",
    "cli.rtde": "a table; tests/cli/test_main.py",
    "cli.rtde.record_options": "tests/cli/rtde/test_record.py tries every contradiction",
    "cli.rtde.recording_run": "tests/cli/rtde/test_record.py ends it in every way",
    "cli.rtde.robot_source": "tests/cli/rtde/test_record.py, with a simulator",
    "cli.rtde.robots": "tests/cli/rtde/test_get.py and test_set.py",
    "cli.rtde.sources": "a protocol; tests/cli/rtde/test_record.py",
    "canopen.manager.boot_steps": "a table; tests/canopen/manager/test_boot.py",
    "canopen.manager.letters": "words; tests/canopen/manager/test_boot.py",
    "canopen.manager.plan": "records; tests/canopen/manager/test_configuration.py",
    "canopen.product": "two numbers; tests/canopen/test_identity.py",
    "core.reception": "what a cell makes of packages; tests/core/test_cell.py, test_cell_properties.py",
    "core.refused": "what a cell counts; tests/core/test_cell.py, test_unserved.py",
    "core.requester": "a record; tests/core/test_cell.py pins what its parts mean",
    "links.canopen_node.compile": "tests/mapping/test_compile.py compiles it",
    "links.canopen_node.exports": "tests/cli/test_export.py",
    "links.canopen_node.plc.content": "tests/links/canopen_node/plc/test_running.py, test_targets.py",
    "links.canopen_node.plc.blocks": "tests/links/canopen_node/plc/test_running.py",
    "links.canopen_node.plc.data": "variables; tests/links/canopen_node/plc/test_targets.py",
    "links.canopen_node.plc.model": "records; tests/links/canopen_node/plc/test_build.py",
    "links.canopen_node.plc.pdo_text": "a table; tests/links/canopen_node/plc/test_targets.py",
    "links.canopen_node.plc.registry": "a table; tests/links/canopen_node/plc/test_build.py",
    "links.canopen_node.objects": "tests/links/canopen_node/test_eds.py, test_status_objects.py, test_variables.py",
    "links.canopen_node.observer": "counters, and calls that do nothing; tests/links/canopen_node/test_node.py",
    "links.contract": "records and protocols; tests/links/test_registry.py",
    "links.standby.plan": "a record; tests/links/standby/test_language.py",
    "links.standby.sections": "tests/links/standby/test_language.py",
    "links.standby.runtime": "tests/links/standby/test_link.py makes its links by it",
    "cli.standby": "tests/e2e/test_standby.py, with two gateways",
    "links.canopen_node.health": "words; tests/links/canopen_node/test_runtime.py",
    "links.canopen_node.routes": "tests/links/canopen_node/test_node.py, test_runtime.py",
    "links.canopen_node.tables": "tests/cli/test_show.py, tests/report/test_table.py",
    "links.devices.doctor": "tests/links/devices/test_declaration.py",
    "links.mqtt.brokers": "tests/e2e/test_mqtt.py, with reloads",
    "links.mqtt.commands": "tests/links/mqtt/test_json_link.py tries each refusal",
    "links.mqtt.description": "tests/links/mqtt/test_declaration.py",
    "links.mqtt.expand": "tests/links/mqtt/test_language.py",
    "links.mqtt.link": "tests/links/mqtt/test_json_link.py, test_node.py",
    "links.mqtt.sparkplug_link": "tests/links/mqtt/test_node.py",
    "links.mqtt.plan": "records; tests/links/mqtt/test_language.py",
    "links.mqtt.runtime": "tests/e2e/test_mqtt.py",
    "links.mqtt.scalars": "tests/links/mqtt/test_language.py, tests/mqtt/test_names.py",
    "links.mqtt.sections": "tests/links/mqtt/test_language.py",
    "links.mqtt.session": "tests/e2e/test_mqtt.py",
    "links.mqtt.tables": "tests/links/mqtt/test_declaration.py",
    "mqtt.connection": "tests/mqtt/test_client.py",
    "mqtt.messages": "records; tests/mqtt/test_client.py",
    "links.devices.families": "a table; tests/links/devices/test_runtime.py, test_language.py",
    "links.devices.family": "a protocol; tests/links/devices/modbus/test_language.py",
    "links.devices.description": "tests/links/devices/test_declaration.py",
    "links.devices.expand": "tests/links/devices/test_language.py",
    "links.devices.link": "tests/links/devices/modbus/test_link.py, canopen/test_link.py",
    "links.devices.places": "records; tests/links/devices/test_language.py",
    "links.devices.plan": "records; tests/links/devices/test_declaration.py",
    "links.devices.served": "tests/links/devices/canopen/test_doctor.py, test_declaration.py",
    "links.devices.sections": "tests/links/devices/test_language.py",
    "links.devices.tables": "tests/links/devices/test_declaration.py",
    "links.devices.canopen.description": "tests/links/devices/canopen/test_language.py",
    "links.devices.canopen.figures": "tests/links/devices/canopen/test_link.py, test_buses.py",
    "links.devices.canopen.managed": "a protocol; tests/links/devices/canopen/test_buses.py",
    "links.devices.canopen.managed_bus": "tests/links/devices/canopen/test_language.py",
    "links.devices.canopen.plan": "records; tests/links/devices/canopen/test_language.py",
    "links.devices.canopen.sections": "tests/links/devices/canopen/test_language.py",
    "links.can_buses": "a record; tests/mapping/test_rules.py",
    "links.devices.modbus.doctor": "tests/links/devices/test_declaration.py",
    "links.devices.modbus.tapped": "tests/links/devices/modbus/test_lines.py",
    "links.devices.modbus.description": "tests/links/devices/test_declaration.py",
    "links.devices.modbus.plan": "records; tests/links/devices/modbus/test_language.py",
    "links.devices.modbus.sections": "tests/links/devices/modbus/test_language.py",
    "links.exports": "the contract; tests/cli/test_export.py",
    "links.language": "a protocol; tests/links/test_registry.py",
    "links.modbus_places.describing": "tests/links/modbus_server/test_description.py",
    "links.modbus_places.located": "records; tests/links/modbus_server/test_expand.py",
    "links.modbus_places.placing": "tests/links/modbus_server/test_expand.py",
    "links.modbus_places.sections": "tests/mapping/test_model.py",
    "links.modbus_places.types": "tests/links/modbus_server/test_language.py",
    "links.modbus_server.declaration": "tests/links/test_registry.py",
    "links.modbus_server.exports": "tests/cli/test_export.py",
    "links.modbus_server.plc.model": "records; tests/links/modbus_server/plc/test_build.py",
    "links.modbus_server.plc.registry": "a table; tests/links/modbus_server/plc/test_targets.py",
    "links.modbus_server.plan": "records; tests/mapping/test_compile.py pins their content",
    "links.modbus_server.tables": "tests/cli/test_show.py, tests/report/test_table.py",
    "links.robot.plan": "records; tests/mapping/test_compile.py pins their content",
    "links.robot.sections": "tests/mapping/test_model.py",
    "links.robot.watchdog": "tests/links/robot/test_runtime.py feeds one",
    "links.tables": "the contract; tests/report/test_table.py",
    "mapping.expanded": "records; tests/mapping/test_expand.py makes them",
    "mapping.plan": "records; tests/mapping/test_compile.py pins their content",
    "mapping.section": "three settings; tests/mapping/test_model.py pins what they do",
    "mapping.syntax": "declarations; tests/mapping/test_rules.py",
    "modbus.client.counters": "numbers; tests/modbus/client/test_station.py",
    "modbus.client.unit": "records and a protocol; tests/modbus/client/test_station.py",
    "modbus.areas": "an enumeration; tests/mapping/test_compile.py",
    "plc.export": "tests/cli/test_export.py",
    "plc.header": "texts; tests/links/modbus_server/plc/test_targets.py",
    "plc.keywords": "lists; tests/plc/test_names.py",
    "plc.tags": "tests/links/modbus_server/plc/test_tags.py",
    "plc.model": "records; tests/links/modbus_server/plc/test_build.py",
    "rtde.recipes": "names of its modules; tests/rtde/recipes",
    "rtde.recording": "names of its modules; tests/rtde/recording",
    "rtde.recording.errors": "errors; tests/rtde/recording/test_writing.py",
    "rtde.messages": "records; tests/rtde/test_codec.py pins them byte by byte",
    "sparkplug.actions": "records and a protocol; tests/sparkplug/conformance/bench.py is a user",
    "sparkplug.declarations": "records; tests/sparkplug/conformance",
    "sparkplug.messages": "tests/sparkplug/conformance reads every message",
    "sparkplug.states": "a table; tests/sparkplug/test_edge_node.py",
    "rtde.types": "records; tests/rtde/test_recipe.py pins their formats",
}
"""Module -> why it has no test file of its own. A module that is only a docstring needs none."""

TESTED_TOGETHER = {
    "links.standby.rules": "tests/mapping/test_rules.py",
    "links.canopen_node.rules": "tests/mapping/test_rules.py",
    "links.canopen_node.plc.targets": "tests/links/canopen_node/plc/test_targets.py",
    "links.modbus_server.plc.logix": "tests/links/modbus_server/plc/test_logix.py",
    "links.modbus_server.plc.st": "tests/links/modbus_server/plc/test_structured_text.py",
    "links.modbus_server.plc.targets": "tests/links/modbus_server/plc/test_targets.py",
    "links.devices.rules": "tests/mapping/test_rules.py",
    "links.mqtt.rules": "tests/mapping/test_rules.py",
    "links.modbus_places.rules": "tests/mapping/test_rules.py",
    "links.modbus_server.rules": "tests/mapping/test_rules.py",
    "links.robot.dashboard.rules": "tests/mapping/test_rules.py",
    "links.robot.rules": "tests/mapping/test_rules.py",
    "plc.logix": "tests/links/modbus_server/plc/test_logix.py",
    "plc.st": "tests/links/modbus_server/plc/test_structured_text.py",
    "mapping.rules": "tests/mapping/test_rules.py",
}
"""Package -> the one file that tests all its modules: rules are tested by their own bad and good examples."""


@cache
def imports(module: str) -> frozenset[str]:
    """Full names of everything that is imported anywhere in the module, under TYPE_CHECKING and in functions too."""
    found: set[str] = set()
    for node in nodes(module):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module}: relative import, line {node.lineno}"
            assert node.module is not None
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                found.add(inner if inner.removeprefix("gatewayd.") in MODULES else node.module)
    return frozenset(found)


def within(name: str, prefixes: Iterable[str]) -> bool:
    """Whether `name` is one of the modules or packages, or lies in one."""
    return any(name == prefix or name.startswith(prefix + ".") for prefix in prefixes)


def own_imports(module: str) -> Iterator[str]:
    """Modules of ours that the module imports, without the package itself, which has only the version."""
    for name in imports(module):
        if name.startswith("gatewayd."):
            yield name.removeprefix("gatewayd.")


def is_empty(module: str) -> bool:
    """Whether it is a docstring alone."""
    return len(tree(module).body) == 1


def test_imports_follow_the_layers() -> None:
    broken = []
    for module in MODULES:
        layer = max((name for name in LAYERS if within(module, {name})), key=len, default=None)
        assert layer is not None, f"{module} belongs to no layer: give it one in LAYERS"
        foreign = {name for name in own_imports(module) if not within(name, LAYERS[layer])}
        broken += [f"{module} (layer {layer}) may not import {name}" for name in sorted(foreign)]
    assert broken == []


def test_no_kind_of_link_is_known_by_name() -> None:
    """Nobody but a link's own folder imports it; the registry names it."""
    links = {name for name in LAYERS if name.startswith("links.") and MODULES[name].name == "__init__.py"}
    named = {layer for layer, allowed in LAYERS.items() if {*links, "links"} & allowed}
    assert named == links


def test_library_types_stay_in_their_adapter() -> None:
    broken = [
        f"{module} may not import {name}"
        for module in MODULES
        for name in sorted(imports(module))
        if not within(module, LIBRARIES.get(name.partition(".")[0], {module}))
    ]
    assert broken == []


def test_pure_modules_have_no_socket_no_loop_and_no_clock() -> None:
    for module in MODULES:
        if within(module, PURE):
            impure = IMPURE_IMPORTS & {name.partition(".")[0] for name in imports(module)}
            assert not impure or module in IMPURE, f"{module} imports {impure}"


def test_whoever_meets_times_of_a_cell_asks_the_one_clock() -> None:
    """CLOCK_MONOTONIC stands still while the machine is suspended, and the times of a cell go on."""
    asking = {
        module
        for module in MODULES
        for node in nodes(module)
        if isinstance(node, ast.Attribute)
        and node.attr == "monotonic"
        and ast.unparse(node) == "time.monotonic"
    }
    assert asking == set(OTHER_CLOCK)


def test_nobody_imports_in_a_circle() -> None:
    """Of the modules that are left when those without importers or imports among them go, none is left."""
    left = {module: set(own_imports(module)) & set(MODULES) for module in MODULES}
    while ends := [module for module, needed in left.items() if not needed & set(left)]:
        for module in ends:
            del left[module]
    while starts := set(left) - set().union(*left.values()):
        for module in starts:
            del left[module]
    assert sorted(left) == []


def test_module_says_what_it_is() -> None:
    assert [module for module in MODULES if not ast.get_docstring(tree(module))] == []


def test_what_begins_with_an_underscore_stays_in_its_module() -> None:
    """So a name says whether it is for others; no list beside it has to be kept in step."""
    broken = [
        f"{module} imports {node.module}.{alias.name}"
        for module in MODULES
        for node in nodes(module)
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("gatewayd")
        for alias in node.names
        if alias.name.startswith("_") and not alias.name.startswith("__")
    ]
    assert broken == []


def test_public_classes_have_names_of_their_own() -> None:
    """One name, one meaning, in the whole package."""
    homes: dict[str, list[str]] = {}
    for module in MODULES:
        for node in tree(module).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                homes.setdefault(node.name, []).append(module)
    assert {name: places for name, places in homes.items() if len(places) > 1} == {}


def test_module_is_short_enough_to_be_read() -> None:
    lengths = {module: len(path.read_text().splitlines()) for module, path in MODULES.items()}
    assert {module: length for module, length in lengths.items() if length > MAX_LENGTH} == {}


def file_of_tests(module: str) -> Path:
    """Where the module's tests belong."""
    *folders, name = module.split(".")
    return ROOT.joinpath("tests", *folders, f"test_{name}.py")


def test_module_has_its_test_file() -> None:
    for module in MODULES:
        if within(module, TESTED_TOGETHER) or is_empty(module):
            continue
        path = file_of_tests(module)
        if module in WITHOUT_TEST_FILE:
            assert not path.exists(), f"{module} has a test file now: strike it from WITHOUT_TEST_FILE"
        else:
            assert path.exists(), f"{path.relative_to(ROOT)} is missing"


def test_tables_name_only_what_exists() -> None:
    """No rule outlives the module that it is about."""
    named = {*LAYERS, *PURE, *IMPURE, *WITHOUT_TEST_FILE, *TESTED_TOGETHER}.union(*LIBRARIES.values())
    assert named - set(MODULES) == set()
    assert [file for file in TESTED_TOGETHER.values() if not (ROOT / file).exists()] == []


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
