"""The fields of the control interface's answers: the contract that docs are made from and tests hold.

Names are never changed and never removed within version 1; new ones may come at any time.
"""

from __future__ import annotations

__all__ = [
    "AUDIT",
    "CANOPEN",
    "CELL",
    "EVENT",
    "LOCK",
    "MODBUS",
    "REFUSAL",
    "ROBOT",
    "STATUS",
    "VARIABLE",
    "VERSION",
    "WRITER",
]

Fields = dict[str, str]
"""Name -> meaning."""

VERSION: Fields = {
    "api": "version of this interface, 1",
    "version": "version of gatewayd",
    "pid": "process id of the daemon",
}
STATUS: Fields = {
    **VERSION,
    "time": "when this was told, UTC",
    "uptime": "seconds since the cores began to turn",
    "healthy": "no cell has a problem, and the gateway as a whole has none",
    "problems": "list of texts: everything that makes it unhealthy, with the name of the cell in front",
    "cells": "list of cells",
}
CELL: Fields = {
    "name": "name of the cell",
    "source": "mapping file as it was named",
    "fingerprint": "32 bits of the mapping's meaning, eight hexadecimal digits",
    "healthy": "robot fresh and writable, CAN bus active, every variable available, in range and as the robot has it, "
    "nothing forced, no writer lost",
    "problems": "list of texts: what makes it unhealthy",
    "robot": "the link to the robot",
    "modbus": "the Modbus side, or null",
    "canopen": "the CANopen side, or null",
    "writers": "list of declared writers",
    "variables": "number of variables: `total`, and by quality as of a variable",
    "locks": "`total`, `owned`, `operator` (held by the local operator)",
    "writes": "requests `accepted` and `refused` since the start",
    "last_refusal": "the last refused request, or null",
    "heartbeat": "counts up every 100 ms",
    "gaps": "times the gateway stood still, stopped, suspended or starved of the CPU",
}
ROBOT: Fields = {
    "address": "host:port of the controller",
    "state": "`lost`, `waiting`, `fresh`, `silent`, `frozen` or `late`",
    "writable": "connected, and its inputs were adopted",
    "age": "seconds since the last package that told anything new, or null",
    "frequency": "packages per second, measured",
    "packages": "packages received",
    "skipped": "packages that the controller left out",
    "late": "packages that came late",
    "sessions": "sessions with the controller; the first one is no reconnect",
    "mismatches": "inputs whose read-back differed from what was written",
    "lag": "seconds by which the newest package is later than the quickest ones were",
    "unadopted": "inputs whose content in the robot is not known",
    "differing": "inputs for which the robot holds something else than it was given",
    "adoption": "seconds until adopted inputs without an owner fall back; 0: none will",
    "watchdog": "whether the robot's watchdog is fed, or null without one",
}
MODBUS: Fields = {
    "listen": "host:port of the listener",
    "unit": "unit id",
    "connections": "open connections of the listener",
}
CANOPEN: Fields = {
    "channel": "interface:channel of the bus",
    "node": "node-ID of the mapping",
    "bus": "`absent`, `down`, `bus-off`, `passive`, `warning` or `active`",
    "nmt_state": "`initialising`, `stopped`, `pre-operational` or `operational`",
}
WRITER: Fields = {
    "name": "name of the writer",
    "alive": "connected, and heard in time (`timeout`, `heartbeat`)",
    "connections": "its open connections",
    "age": "seconds since its last request, or null",
    "timeout": "seconds without a request after which it counts as lost, or null",
    "locks": "number of locks that it owns",
}
REFUSAL: Fields = {
    "variable": "name of the variable, or null",
    "writer": "name of the writer that was refused, or null if it is not declared",
    "holder": "name of the owner that stood in the way, or null",
    "reason": "why, in words",
    "age": "seconds since then",
    "text": "the refusal in one sentence",
}
VARIABLE: Fields = {
    "cell": "name of the cell",
    "number": "as the status block counts it, from 1",
    "name": "name of the variable",
    "direction": "`input` (fieldbus to robot) or `output` (robot to fieldbus)",
    "kind": "`bool`, `int` or `float`",
    "robot": "what it is in the robot: `input_int_register_0`, `actual_TCP_pose[2]`",
    "modbus": "list of its places: `area`, `address` from 0, `bit` or null, `notation` (4xxxxx form)",
    "canopen": "null, or `object` (2010h:01), `type`, and `cob_id` of the PDO that carries it, null for SDO alone",
    "value": "true or false, or a number in the robot's unit; the texts `nan`, `inf`, `-inf`",
    "unit": "unit of the value, may be empty",
    "quality": "`good`, `stale`, `unavailable`, `never`, `forced`, `differs` (the robot holds something else), "
    "`out_of_range` (one of its places cannot show the value) or `not_running` (valid only while the program runs)",
    "age": "seconds since its source told it, or null if it never did",
    "lock": "name of the lock that guards it, or null (outputs)",
    "owner": "name of the writer that owns it now, `operator`, or null",
    "lease": "seconds of the owner's lease left, or null without an owner or end",
    "forced": "null, or `value` and `remaining` seconds of a force",
    "limits": "null, or lowest and highest value",
    "fallback": "what is seen when owner (inputs) or robot (outputs) are lost: `clear`, `hold`, `exception` or a value",
    "comment": "comment of the mapping, may be empty",
}
LOCK: Fields = {
    "cell": "name of the cell",
    "name": "name of the lock: of its variable or group",
    "members": "names of its variables",
    "owners": "names of the writers that may own it, by priority where `takeover` is true",
    "takeover": "an earlier writer takes it from a later one",
    "declared_lease": "seconds of lease, or null",
    "owner": "name of the owner now, `operator`, or null",
    "remaining": "seconds until the owner loses it without renewing, or null",
}
EVENT: Fields = {
    "seq": "number of the event within its cell, from 1; ask for later ones with `after`",
    "time": "when, UTC",
    "cell": "name of the cell",
    "event": "what: `robot lost`, `write refused` ... (all in the reference of the log)",
    "variable": "name of the variable",
    "lock": "name of the lock",
    "writer": "name of the writer who did it or whom it befell; `operator`, `undeclared` or `gateway`",
    "other": "former owner of a lock taken over, or holder in a refusal",
    "reason": "why it was refused, in words",
    "peer": "address of an undeclared peer",
    "old": "value before",
    "new": "value after, or refused",
    "repeats": "further refusals like this one, counted since the last told",
    "detail": "more, in words",
    "text": "all that in one sentence for people, values with their unit; it may be worded anew at any time",
    "bad": "somebody should look at it",
}
"""Fields that do not apply are left out, but for the first four, `text` and `bad`."""
AUDIT: Fields = {
    "time": "when, UTC; of merged changes, the last one's",
    "monotonic": "seconds of the gateway's own clock; equal for all changes of one request",
    "cell": "name of the cell",
    "what": "`write accepted`, `write refused`, `lock acquired`, `lock taken over`, `lock released`, "
    "`fallback applied`, `image follows the robot`, `value forced`, `force ended`",
    "writer": "name of the writer; `operator`, `undeclared` or `gateway`",
    "variable": "name of the variable",
    "lock": "name of the lock",
    "old": "value before; of merged changes, before the first",
    "new": "value after, or refused; of merged changes, the last",
    "times": "changes or refusals that the record stands for, if more than one",
    "holder": "owner that stood in the way, or former owner",
    "reason": "why it was refused, in words",
    "peer": "address of an undeclared peer",
    "detail": "more, in words",
    "text": "all that in one sentence, as of an event; the audit's file does not have it",
    "bad": "somebody should look at it; not in the file either",
}
"""Fields that do not apply are left out, but for the first four, `text` and `bad`."""
