"""What a reload does with each key of the mapping language, as rows for test_reload_keys.py."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

REMOVED = object()
Changes = Mapping[str, Any]
ROBOT_PORT, MODBUS_PORT, OTHER_PORT, CHANNEL = "ROBOT_PORT", "MODBUS_PORT", "OTHER_PORT", "CHANNEL"
TLS_PORT, NEXT_TLS = "TLS_PORT", "NEXT_TLS"
TRUST = "/TRUST"
"""Folder with what `make_certificates` makes."""
SECURED_SECTION = "modbus with TLS"
"""Its rows need certificates."""

BASE: dict[str, Any] = {
    "gatewayd": 1,
    "cell": "press",
    "robot": {"host": "127.0.0.1", "port": ROBOT_PORT, "stale_after": "5s", "adopt_for": "100s"},
    "modbus": {"listen": MODBUS_PORT},
    "canopen": {
        "interface": "virtual",
        "channel": CHANNEL,
        "bitrate": 500000,
        "node": 5,
        "autostart": True,
        "cob_ids": {"tpdo": "0x1A0..0x1A3", "rpdo": "0x220..0x223"},
        "pdos": {
            "command": {"cob_id": "0x205", "deadline": "30s", "variables": ["speed"]},
            "report": {"cob_id": "0x185", "variables": ["count"]},
        },
    },
    "writers": {
        "plc": {"modbus": "127.0.0.1", "timeout": "20s", "grace": "1s"},
        "hmi": {"modbus": "127.0.0.3"},
        "line": {"canopen": "rpdo", "node": 7, "heartbeat": "20s"},
    },
    "groups": {"motion": {"owner": ["plc", "hmi"], "lease": "20s"}},
    "variables": {
        "number": {"robot": "input_int_register_0", "modbus": {"holding": 1}, "group": "motion"},
        "other": {"robot": "input_int_register_2", "modbus": 3, "group": "motion"},
        "speed": {"robot": "input_int_register_1", "owner": "line", "canopen": {"pdo": "command"}},
        "free": {"robot": "input_double_register_0", "modbus": 10, "owner": "plc", "limits": [0, 150]},
        "list": {"robot": "input_int_register_3", "modbus": 14, "owner": ["plc", "hmi"], "lease": "5s"},
        "bit": {"robot": "input_bit_register_0", "modbus": 16.0, "owner": "plc"},
        "count": {"robot": "output_int_register_0", "modbus": 100, "canopen": {"pdo": "report"}},
        "level": {"robot": "output_double_register_0", "modbus": {"holding": 110}},
        "lamp": {"robot": "output_bit_register_0", "modbus": {"discrete": 7}},
    },
}
WATCHED = {"robot.watchdog": {"field": "input_int_register_20", "frequency": 20, "requires": ["plc", "hmi"]}}
CLEARING = {"robot.adopt_for": REMOVED, "robot.on_connect": "fallback"}
SWAPPED = {"writers.plc.modbus": "127.0.0.3", "writers.hmi.modbus": "127.0.0.1"}
LONGER_RPDO = {
    "canopen.pdos.command.variables": ["speed", "more"],
    "variables.more": {"robot": "input_int_register_9", "owner": "line", "canopen": {"pdo": "command"}},
}
BY_SDO = {"canopen.pdos.command": REMOVED, "variables.speed.canopen": {"pdo": "none"}}
BY_MODBUS = {
    "canopen.pdos.command": REMOVED,
    "variables.speed": {"robot": "input_int_register_1", "owner": "plc", "modbus": 40},
}
GUARDING = {"time": "100ms", "factor": 3}
GUARDED = {"canopen.heartbeat": "none", "canopen.guarding": GUARDING}
TOMORROW = {"field": "output_of_today", "type": "DOUBLE", "direction": "output"}
NEWER = {"variables.level.robot": TOMORROW}
GUARDING_LINE = {
    "canopen.heartbeat": "none",
    "writers.line": {"canopen": "rpdo", "guarding": "20s"},
}
NOBODY_ANSWERS = "127.0.0.9:1502"
ISLAND = {
    "devices": {"island": {"modbus": NOBODY_ANSWERS}},
    "writers.island": {"device": "island"},
    "variables.present": {
        "robot": "input_bit_register_9",
        "device": {"at": "island", "discrete": 3},
        "owner": "island",
    },
    "variables.force": {
        "robot": "output_int_register_9",
        "device": {"at": "island", "holding": 9, "type": "uint16"},
    },
}
OTHER_ISLAND = {
    "modbus": "127.0.0.9:1503",
    "framing": "rtu",
    "unit": 2,
    "poll": "20ms",
    "timeout": "100ms",
    "lost_after": "2s",
    "watchdog": "3s",
    "failures": 2,
    "gap": 8,
    "single": True,
    "connect": "per_request",
    "write": "multiple",
    "mask_write": False,
    "identify": True,
    "serial_number": "100..101",
    "order": "CDAB",
}
OTHER_LINE = {"serial": "/dev/no-such-port", "baudrate": 19200, "parity": "even", "stop_bits": 1}
OTHER_PLACE = {
    "variables.present.device": {"coil": 4, "poll": "1s"},
    "variables.force.device": {
        "holding": 9,
        "bits": "0..7",
        "rest": 0,
        "on_connect": "write",
        "every": "1s",
    },
    "variables.more": {
        "robot": "input_double_register_9",
        "device": {"input": 4, "type": "float32", "order": "CDAB", "scale": 2, "offset": 1},
        "owner": "island",
    },
}
ENCODER = {
    "devices": {"encoder": {"canopen": "cell", "interface": "virtual", "node": 9, "heartbeat": "1s"}},
    "writers.encoder": {"device": "encoder"},
    "variables.position": {
        "robot": "input_int_register_9",
        "device": {"object": "0x6004", "type": "uint32", "pdo": 1},
        "owner": "encoder",
    },
}
OTHER_ENCODER = {
    "canopen": "line",
    "interface": "virtual",
    "bitrate": 250000,
    "node": 10,
    "eds": str(Path(__file__).parents[2] / "mappings/encoder.eds"),
    "heartbeat": "2s",
    "mandatory": True,
    "keep": True,
    "store": True,
    "revision": 1,
    "expected_serial": 7,
    "software": "1.0",
    "transmission": "sync",
    "inhibit": "10ms",
    "event": "1s",
    "sync": "100ms",
    "manager": 3,
    "manager_heartbeat": "200ms",
}
OTHER_OBJECT = {"object": "0x6030", "sub": 1, "type": "int16", "pdo": "none", "poll": "1s"}
DASHBOARD = {
    "robot.series": "e",
    "robot.dashboard": {"port": 1504, "programs": {1: "pick.urp"}, "poll": "1s"},
    "variables.play": {"dashboard": "play", "modbus": {"coil": 40}, "owner": "hmi"},
}
# `plc` drives by the listener without TLS, which stays; a client of the other is in tests/links/modbus_server.
SECURED = {
    "modbus.tls": {
        "listen": TLS_PORT,
        "certificate": f"{TRUST}/ours/gateway.crt",
        "key": f"{TRUST}/ours/gateway.key",
        "clients": f"{TRUST}/ours/authority.crt",
        "roles": {
            "operator": {"read": "all", "write": "all"},
            "setter": {"read": ["count"], "write": ["number", "other"]},
        },
        "without_role": {"read": ["count"], "write": ["list"]},
    }
}
BY_ROLE = {**SECURED, "writers.hmi.role": "operator"}
BROKER = {"mqtt": {"host": "127.0.0.9", "topic": "plant/press"}}
ENCRYPTED = {"mqtt": {**BROKER["mqtt"], "tls": {}}}
SPARKPLUG = {"mqtt": {"host": "127.0.0.9", "sparkplug": {"group": "plant", "node": "hall-2"}}}
NAMED = {**BROKER, "variables.level.mqtt": {"name": "height", "deadband": 1, "interval": "2s"}}
SCADA = {
    **BROKER,
    "writers.scada": {"mqtt": "set", "timeout": "20s"},
    "variables.recipe": {"robot": "input_int_register_9", "owner": "scada", "mqtt": "recipe"},
}


def keys_of(name: str, table: Mapping[str, Any]) -> str:
    return " ".join(f"{name}.{key}" for key in table)


STANDBY = {"peer": ["127.0.0.8:2930"], "grace": "100s"}
BOTH, PLC, LINE, NOBODY = "plc line", "plc", "line", ""


@dataclass(frozen=True)
class Row:
    """A change of one key, and what comes of it."""

    key: str
    """One, or several with blanks between them that are changed together."""
    changes: Changes
    kinds: str = ""
    """Of its objections, in their order."""
    kept: str = BOTH
    """Who still owns what it owned."""
    given: Changes = field(default_factory=dict)
    """What is otherwise from the start."""


def row(path: str, value: Any, kinds: str = "", kept: str = BOTH, given: Changes | None = None) -> Row:
    return Row(_key(path), {path: value}, kinds, kept, given or {})


def _key(path: str) -> str:
    """`writers.plc.timeout` -> `writers.*.timeout`."""
    parts = path.split(".")
    named = 2 if parts[:2] == ["canopen", "pdos"] else 1
    if parts[0] in ("writers", "groups", "variables") or named == 2:
        parts[named:] = ["*", *parts[named + 1 :]] if len(parts) > named + 1 else []
    return ".".join(parts)


ROWS: dict[str, list[Row]] = {
    "file": [
        # The version has one value; a file of another one is refused by `check`.
        row("gatewayd", 1),
        row("cell", "stamp", "release gone", NOBODY),
        # `gatewayd test` reads them; whoever serves does not.
        row("tests", {"it begins at rest": [{"expect": {"speed": 0}}]}),
    ],
    "robot": [
        Row("robot", {"robot.host": "127.0.0.9"}, "release", NOBODY),
        row("robot.host", "127.0.0.9", "release", NOBODY),
        row("robot.port", 1, "release", NOBODY),
        row("robot.series", "e"),
        row("robot.version", "5.12"),
        row("robot.frequency", 100),
        row("robot.frequency", 100, "watchdog", given=WATCHED),
        row("robot.stale_after", "6s", "weakening"),
        row("robot.stale_after", "4s"),
        row("robot.on_connect", "fallback", given={"robot.adopt_for": REMOVED}),
        row(
            "robot.on_connect",
            "adopt",
            "weakening",
            given=CLEARING,
        ),
        row("robot.adopt_for", "none", "weakening"),
        row("robot.adopt_for", "50s"),
        row("robot.verify", False, "weakening"),
        row("robot.valid", "running"),
        row("robot.valid", REMOVED, "weakening", given={"robot.valid": "running"}),
        row("robot.watchdog", WATCHED["robot.watchdog"]),
        row("robot.watchdog", REMOVED, "weakening", given=WATCHED),
        row("robot.watchdog.field", "input_int_register_21", "watchdog weakening", given=WATCHED),
        row("robot.watchdog.frequency", 10, "watchdog weakening", given=WATCHED),
        row("robot.watchdog.requires", ["plc"], "weakening", given=WATCHED),
        row("robot.watchdog.requires", ["plc", "hmi", "line"], given=WATCHED),
    ],
    "modbus": [
        Row("modbus", {"modbus.listen": OTHER_PORT}, "release", LINE),
        row("modbus.listen", OTHER_PORT, "release", LINE),
        row("modbus.unit", 2, "release", LINE),
        row("modbus.allow", ["127.0.0.0/8"]),
        row("modbus.allow", ["127.0.0.0/8"], "weakening", given={"modbus.allow": ["127.0.0.1", "127.0.0.3"]}),
        row("modbus.default_unit", True),
        row("modbus.default_unit", False, given={"modbus.default_unit": True}),  # a sole cell is it anyway
        row("modbus.connections", 2),
        row("modbus.connections_per_peer", 1),
        row("modbus.idle_timeout", "1s"),
        row("modbus.gaps", "zero"),
        row("modbus.write_gaps", "ignore"),
        row("modbus.robot_away", "busy"),
        row("modbus.order", "CDAB", "owned"),
    ],
    SECURED_SECTION: [
        Row("modbus.tls", SECURED),
        row("modbus.tls", REMOVED, given=SECURED),
        row("modbus.listen", REMOVED, "release", LINE, given=SECURED),
        row("modbus.tls.listen", NEXT_TLS, given=SECURED),
        Row(
            "modbus.tls.certificate modbus.tls.key",
            {
                "modbus.tls.certificate": f"{TRUST}/ours/none.crt",
                "modbus.tls.key": f"{TRUST}/ours/none.key",
            },
            given=SECURED,
        ),
        row("modbus.tls.clients", f"{TRUST}/other/authority.crt", "weakening", given=SECURED),
        row("modbus.tls.revoked", f"{TRUST}/ours/revoked.crl", given=SECURED),
        row(
            "modbus.tls.revoked",
            REMOVED,
            "weakening",
            given={**SECURED, "modbus.tls.revoked": f"{TRUST}/ours/revoked.crl"},
        ),
        Row("modbus.tls.roles", {"modbus.tls.roles.viewer": {"read": "all"}}, "weakening", given=SECURED),
        Row("modbus.tls.roles", {"modbus.tls.roles.setter": REMOVED}, given=SECURED),
        Row(
            "modbus.tls.roles.*.read",
            {"modbus.tls.roles.setter.read": ["count", "level"]},
            "weakening",
            given=SECURED,
        ),
        Row("modbus.tls.roles.*.read", {"modbus.tls.roles.setter.read": REMOVED}, given=SECURED),
        Row("modbus.tls.roles.*.write", {"modbus.tls.roles.setter.write": "all"}, "weakening", given=SECURED),
        Row("modbus.tls.roles.*.write", {"modbus.tls.roles.setter.write": ["number"]}, given=SECURED),
        row("modbus.tls.without_role", REMOVED, given=SECURED),
        row(
            "modbus.tls.without_role",
            {"read": "all"},
            "weakening",
            given={**SECURED, "modbus.tls.without_role": {}},
        ),
        row("modbus.tls.without_role.read", ["count", "level"], "weakening", given=SECURED),
        row("modbus.tls.without_role.read", REMOVED, given=SECURED),
        row("modbus.tls.without_role.write", ["list", "bit"], "weakening", given=SECURED),
        row("modbus.tls.without_role.write", REMOVED, given=SECURED),
        # Its connection has shown no certificate.
        row("writers.plc.role", "operator", "release", LINE, given=SECURED),
        row("writers.hmi.role", "operator", given=SECURED),
        row("writers.hmi.role", "setter", given=BY_ROLE),
        row("writers.hmi.role", REMOVED, "weakening", given=BY_ROLE),
    ],
    "canopen": [
        Row("canopen", {"canopen.node": 6}, "release", PLC),
        row("canopen.interface", "udp_multicast", "release", PLC),
        row("canopen.channel", "elsewhere", "release", PLC),
        row("canopen.bitrate", 250000, "release", PLC),
        row("canopen.node", 6, "release", PLC),
        row("canopen.autostart", False),
        row("canopen.heartbeat", "1s", "weakening"),
        row("canopen.heartbeat", "200ms"),
        row("canopen.identity", {"vendor": 1}, "release identity", PLC),
        row("canopen.identity.vendor", 1, "release identity", PLC),
        row("canopen.identity.product", 1, "release identity", PLC),
        row("canopen.identity.revision", 7, "release identity", PLC),
        row("canopen.identity.serial", 7, "release identity", PLC),
        row("canopen.sync", {"period": "100ms"}, "release", PLC),
        row("canopen.sync.cob_id", "0x81", "release", PLC),
        row("canopen.sync.producer", True, "release", PLC, given={"canopen.sync.period": "100ms"}),
        row("canopen.sync.period", "200ms", "release", PLC, given={"canopen.sync.period": "100ms"}),
        row(
            "canopen.sync.counter",
            10,
            "release",
            PLC,
            given={"canopen.sync": {"producer": True, "period": "100ms"}},
        ),
        row("canopen.sync.window", "50ms", "release", PLC),
        row("canopen.guarding", GUARDING, "release", PLC, {"canopen.heartbeat": "none"}),
        row("canopen.guarding.time", "200ms", "release", PLC, GUARDED),
        row("canopen.guarding.factor", 4, "release", PLC, GUARDED),
        row("canopen.emcy", {"inhibit": "50ms"}),
        row("canopen.emcy.inhibit", "50ms"),
        row("canopen.on_communication_error", "stay", "release", PLC),
        row("canopen.pdo", {"inhibit": "10ms"}),
        row("canopen.pdo.transmission", "sync", "release", PLC),
        row("canopen.pdo.inhibit", "10ms"),
        row("canopen.pdo.event", "1s"),
        row("canopen.pdo.deadline", "20s"),
        row("canopen.pdo.real", "REAL32"),
        row("canopen.cob_ids", {"tpdo": "0x1A0"}),
        row("canopen.cob_ids.tpdo", "0x1A0"),
        row("canopen.cob_ids.rpdo", "0x220"),
        Row("canopen.pdos", {"canopen.pdos.more": {"cob_id": "0x1A0", "variables": ["level"]}}),
        row("canopen.pdos.command.cob_id", "0x220", "release", PLC),
        row("canopen.pdos.command.transmission", 1, "release", PLC),
        row("canopen.pdos.report.inhibit", "10ms"),
        row("canopen.pdos.report.event", "1s"),
        row("canopen.pdos.command.deadline", "60s", "weakening"),
        row("canopen.pdos.command.deadline", "20s"),
        row(
            "canopen.pdos.report.sync_start", 3, "release", PLC, given={"canopen.pdos.report.transmission": 1}
        ),
        row("canopen.pdos.report.status", ["flags"], "release", PLC),
        Row("canopen.pdos.*.variables", LONGER_RPDO, "release", PLC),
        row("canopen.pdos.report.variables", ["count", "lamp"]),
        row("canopen.pdos.report.comment", "for people"),
    ],
    "writers": [
        Row("writers", {"writers.more": {"modbus": "127.0.0.4"}}),
        row("writers.plc.modbus", "127.0.0.5", "release", LINE),
        row("writers.plc.modbus", ["127.0.0.1", "127.0.0.5"]),
        Row(
            "writers.*.modbus",
            {"writers.plc.modbus": "127.0.0.3", "writers.hmi.modbus": "127.0.0.1"},
            "release",
            LINE,
        ),
        row("writers.line.canopen", "any", "release", PLC),
        row("writers.line.node", 8, "release", PLC),
        row("writers.line.heartbeat", "10s"),
        row("writers.line.heartbeat", "30s", "weakening"),
        row("writers.line.pdos", ["command"], "release", PLC),
        row("writers.line.pdos", REMOVED, "release", PLC, {"writers.line.pdos": ["command"]}),
        row("writers.line.guarding", "10s", given=GUARDING_LINE),
        row("writers.line.guarding", "30s", "weakening", given=GUARDING_LINE),
        row("writers.line.guarding", REMOVED, "release weakening", PLC, GUARDING_LINE),
        row("writers.plc.timeout", "10s"),
        row("writers.plc.timeout", "30s", "weakening"),
        row("writers.plc.timeout_counts", "writes"),
        row(
            "writers.plc.timeout_counts",
            "requests",
            "weakening",
            given={"writers.plc.timeout_counts": "writes"},
        ),
        row("writers.plc.grace", "500ms"),
        row("writers.plc.grace", "2s", "weakening"),
    ],
    # A device goes on by itself: whatever changes of it ends only what it was given itself.
    "devices": [
        Row("devices writers.*.device variables.*.device", ISLAND),
        Row(keys_of("devices.*", OTHER_ISLAND), {"devices.island": OTHER_ISLAND}, given=ISLAND),
        Row("devices.*.in_flight", {"devices.island.in_flight": 4}, given=ISLAND),
        Row(keys_of("devices.*", OTHER_LINE), {"devices.island": OTHER_LINE}, given=ISLAND),
        Row(
            "variables.*.device.coil variables.*.device.poll variables.*.device.bits variables.*.device.rest "
            "variables.*.device.on_connect variables.*.device.every variables.*.device.input "
            "variables.*.device.type variables.*.device.order variables.*.device.scale "
            "variables.*.device.offset",
            OTHER_PLACE,
            given=ISLAND,
        ),
        Row(
            "variables.*.device.at variables.*.device.discrete variables.*.device.holding",
            {
                "devices.more": {"modbus": NOBODY_ANSWERS, "unit": 2},
                "writers.island": {"device": "more"},
                "variables.present.device": {"at": "more", "discrete": 8},
                "variables.force.device": {"at": "more", "holding": 3, "type": "uint16"},
            },
            given=ISLAND,
        ),
        Row(keys_of("devices.*", OTHER_ENCODER), {"devices.encoder": OTHER_ENCODER}, given=ENCODER),
        Row(
            keys_of("variables.*.device", OTHER_OBJECT),
            {"variables.position.device": OTHER_OBJECT},
            given=ENCODER,
        ),
    ],
    # No broker answers, so nobody commands by it: a client and what it loses are in tests/links/mqtt.
    "mqtt": [
        # What is owned would be published by another name, or at another pace.
        Row("mqtt", BROKER, "owned"),
        row("mqtt", REMOVED, "owned", given=BROKER),
        row("mqtt.host", "127.0.0.10", given=BROKER),
        row("mqtt.port", 1884, given=BROKER),
        row("mqtt.version", 5, given=BROKER),
        row("mqtt.username", "press", given=BROKER),
        Row(
            "mqtt.password_file",
            {"mqtt.username": "press", "mqtt.password_file": "/no/such/file"},
            given=BROKER,
        ),
        row("mqtt.client", "press", given=BROKER),
        row("mqtt.keepalive", "20s", given=BROKER),
        row("mqtt.topic", "plant/stamp", "owned", given=BROKER),
        row("mqtt.publish", "named", "owned", given=BROKER),
        row("mqtt.interval", "100ms", "owned", given=BROKER),
        row("mqtt.every", "none", given=BROKER),
        row("mqtt.retain", True, given=BROKER),
        row("mqtt.store", {"keep": "1s", "size": 1}, given=BROKER),
        row("mqtt.store.keep", "none", given=BROKER),
        row("mqtt.store.size", 1, given=BROKER),
        row("mqtt.tls", {}, given=BROKER),
        row("mqtt.tls", REMOVED, given=ENCRYPTED),
        row("mqtt.tls.ca", "/no/such/ca.crt", given=ENCRYPTED),
        Row(
            "mqtt.tls.certificate mqtt.tls.key",
            {"mqtt.tls.certificate": "/no/such/press.crt", "mqtt.tls.key": "/no/such/press.key"},
            given=ENCRYPTED,
        ),
        Row("mqtt.sparkplug", SPARKPLUG, "owned", given=BROKER),
        row("mqtt.sparkplug.group", "works", given=SPARKPLUG),
        row("mqtt.sparkplug.node", "hall-3", given=SPARKPLUG),
        row("mqtt.sparkplug.device", "stamp", given=SPARKPLUG),
        row("mqtt.sparkplug.primary_host", "scada", given=SPARKPLUG),
        row("variables.number.mqtt", "part", "owned", given=BROKER),
        row("variables.number.mqtt", "none", "owned", given=BROKER),
        row("variables.level.mqtt.publish", False, given={**BROKER, "variables.level.mqtt": {}}),
        row("variables.level.mqtt.name", "level_2", given=NAMED),
        row("variables.level.mqtt.deadband", 5, given=NAMED),
        row("variables.level.mqtt.interval", "5s", given=NAMED),
        Row("writers.*.mqtt", SCADA, given=BROKER),
        row("writers.scada.mqtt", "command", given=SCADA),
        row("writers.plc.mqtt", "set", given=BROKER),
        # It is known by its topic alone then, and its connection is nobody's.
        Row(
            "writers.*.mqtt",
            {"writers.plc": {"mqtt": "set", "timeout": "20s"}},
            "release",
            LINE,
            given=BROKER,
        ),
    ],
    "dashboard": [
        Row("robot.dashboard variables.*.dashboard", DASHBOARD),
        row("robot.dashboard.port", 1505, given=DASHBOARD),
        row("robot.dashboard.programs", {1: "place.urp"}, given=DASHBOARD),
        row("robot.dashboard.poll", "2s", given=DASHBOARD),
    ],
    "standby": [
        Row("standby", {"standby": {**STANDBY, "grace": "100ms"}}, "release", NOBODY),
        row("standby.peer", ["127.0.0.8:2931"], given={"standby": STANDBY}),
        row("standby.listen", "127.0.0.1:2932", given={"standby": STANDBY}),
        row("standby.grace", "50s", given={"standby": STANDBY}),
        row("standby.grace", "none", "weakening", given={"standby": STANDBY}),
        row("standby.address", "192.0.2.50", given={"standby": STANDBY}),
    ],
    "groups": [
        Row(
            "groups",
            {"groups.motion": REMOVED, "variables.number.group": REMOVED, "variables.other.group": REMOVED},
            "release weakening",
            LINE,
        ),
        row("groups.motion.owner", ["hmi", "plc"], "owned weakening"),
        row("groups.motion.owner", ["hmi"], "release", LINE),
        row("groups.motion.lease", "10s", "owned"),
        row("groups.motion.lease", "40s", "owned weakening"),
        row("groups.motion.takeover", False, "owned weakening"),
        row("groups.motion.whole", True, "owned"),
        row("groups.motion.comment", "for people"),
    ],
    "variables": [
        Row("variables", {"variables.more": {"robot": "output_int_register_1", "canopen": "auto"}}),
        Row("variables", {"variables.more": {"robot": "input_int_register_9", "modbus": 30, "owner": "plc"}}),
        Row(
            "variables",
            {"variables.level": REMOVED, "variables.lamp": REMOVED, "variables.bit": REMOVED},
            "gone",
        ),
        row("variables.number.robot", "input_int_register_5", "release", LINE),
        row("variables.level.robot", {"field": "output_of_tomorrow", "type": "DOUBLE"}),
        Row(
            "variables.*.robot.field",
            {"variables.level.robot": {**TOMORROW, "field": "output_of_tomorrow"}},
            given=NEWER,
        ),
        Row("variables.*.robot.type", {"variables.level.robot": {**TOMORROW, "type": "UINT32"}}, given=NEWER),
        Row(
            "variables.*.robot.direction",
            {"variables.level.robot": {**TOMORROW, "direction": "input"}},
            "direction",
            given=NEWER,
        ),
        row("variables.count.robot", "input_int_register_5", "release direction", PLC),
        row("variables.number.modbus", 20, "owned"),
        row("variables.number.modbus.holding", 20, "owned"),
        row("variables.level.modbus", {"input": 3}),
        Row("variables.*.modbus.input", {"variables.level.modbus": {"input": 3}}),
        Row("variables.*.modbus.coil", {"variables.bit.modbus": {"coil": 3}}),
        row("variables.lamp.modbus.discrete", 9),
        row("variables.number.modbus.type", "int16", "owned"),
        row("variables.number.modbus.order", "CDAB", "owned"),
        row("variables.number.modbus.scale", 2, "owned"),
        row("variables.number.modbus.offset", 2, "owned"),
        row("variables.number.canopen", "object", "release owned", PLC),
        row("variables.free.canopen", "object"),
        row("variables.level.canopen", "object"),
        row("variables.level.canopen", "auto"),
        Row("variables.*.canopen", BY_SDO, "release", PLC, {"writers.line.canopen": "any"}),
        Row("variables.*.canopen.pdo", BY_SDO, "release", PLC, {"writers.line.canopen": "any"}),
        row("variables.speed.canopen.scale", 2, "release", PLC),
        row("variables.speed.canopen.offset", 2, "release", PLC),
        row("variables.speed.canopen.type", "INTEGER16", "release", PLC),
        row("variables.speed.owner", ["line", "plc"], "owned weakening"),
        Row("variables.*.owner", BY_MODBUS, "release weakening", PLC),
        row("variables.list.takeover", False, "weakening"),
        row("variables.speed.lease", "30s", "owned"),
        row("variables.list.lease", "10s", "weakening"),
        row("variables.other.group", REMOVED, "release weakening", LINE),
        row("variables.free.limits", [0, 200], "weakening"),
        row("variables.free.limits", [0, 100]),
        row("variables.number.limits", [0, 100], "owned"),
        row("variables.free.clamp", True, "weakening"),
        row("variables.number.on_release", 5, "owned"),
        row("variables.free.on_release", "hold", "weakening"),
        row("variables.level.on_stale", "hold", "weakening"),
        row("variables.level.on_stale", 3),
        row("variables.level.valid", "running"),
        row("variables.level.valid", REMOVED, "weakening", given={"variables.level.valid": "running"}),
        row("variables.level.deadband", 1, given={"variables.level.canopen": "auto"}),
        row("variables.number.unit", "mm"),
        row("variables.number.comment", "for people"),
    ],
}
