"""No sentence says "1 bytes" or "0 excuses": whatever counts something takes its noun from `counted`, or has none."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import pytest

from gatewayd.canopen.describe import frame_text
from gatewayd.canopen.errors import ControllerFlags, ErrorClass, ErrorFrame, Violation
from gatewayd.canopen.frame import Frame
from gatewayd.cli import status
from gatewayd.core.adoption import adopted
from gatewayd.core.events import Event, EventKind
from gatewayd.core.image import ProcessImage
from gatewayd.core.refusal import Reason
from gatewayd.core.refusal_log import REFUSAL_INTERVAL, RefusalLog
from gatewayd.links.contract import TrafficDecoder
from gatewayd.links.robot.traffic import RtdeTraffic
from gatewayd.mapping.diagnostics import Diagnostic, Position
from gatewayd.mapping.rules import catalogue
from gatewayd.modbus.describe import answer_text, request_text
from gatewayd.report.event_text import ACCEPTED, EventRecord
from gatewayd.report.findings import CheckOutcome, as_text
from gatewayd.rtde.codec import ClientProtocol
from gatewayd.rtde.describe import package_text
from gatewayd.service.startup import Startup
from tests.sources import MODULES, nodes

_NOUNS = (
    "addresses|bits|bytes|cells|changes|characters|clients|connections|elements|errors|events|fields|files|forces|"
    "frames|groups|handshakes|heartbeats|inputs|lines|locks|members|messages|names|nodes|numbers|objects|outputs|"
    "packages|PDOs|peers|places|records|registers|requests|RPDOs|sessions|sources|spaces|targets|times|traces|types|"
    "units|values|variables|words|writers|writes"
)
_BEFORE_A_NOUN = re.compile(rf"^ (?:(?!has|is|was)\w+ )?(?:{_NOUNS})\b(?!/s)")
_COUNTED = re.compile(r"counted\(|[A-Z_]+$|_HEADER\.size$")

NEVER_ONE = {
    "canopen.manager.configuration: count": "more than the limit",
    "links.devices.link: self.plan.name": "not a number, and changes is a verb",
    "links.devices.rules.objects: bits": "more than 64",
    "links.devices.canopen.proposal: bits": "more than 64",
    "canopen.manager.pdo_content: shift": "more than 64",
    "cli.rtde.recorder: wanted": "more than can be kept",
    "control.names: len(text)": "longer than any pattern may be",
    "links.canopen_node.rules.bus: len(bus)": "where there are several cells",
    "links.canopen_node.rules.node: names": "not a number, and writes is a verb",
    "links.canopen_node.rules.pdos: len(pdos)": "more than the four predefined ones",
    "links.canopen_node.rules.pdos: pdo.bits": "more than 64",
    "links.devices.declaration: len(STATUS_WORDS)": "16 of them",
    "links.modbus_server.rules.places: limit": "the greatest block of a request",
    "links.standby.sections: len(peers)": "more than two",
    "links.robot.rules.fields: size": "more than 2048",
    "links.robot.rules.fields: len(names)": "as many as take more than 2048 bytes",
    "links.mqtt.json_link: message.length": "more than is read",
    "links.mqtt.node: message.length": "more than is read",
    "links.mqtt.traffic: packet.length": "more than is read",
    "machine.der: len(found)": "any number but one",
    "mqtt.names: len(topic)": "none, or longer than any topic may be",
    "mqtt.packets: length": "more than is read",
    "mqtt.engine: len(packet)": "more than a broker takes",
    "mqtt.wire: len(data)": "more than 65535",
    "mqtt.words: len(data)": "more than is shown",
    "sparkplug.payload: len(data)": "more than the limit",
    "sparkplug.primary_host: len(data)": "more than the limit",
    "mapping.rules.bounds: len(cell.variables)": "more than the limit",
    "mapping.rules.bounds: len(writers)": "more than the limit",
    "mapping.scalars: len(text)": "longer than any name may be",
    "report.printable: len(text)": "longer than what is shown",
    "rtde.codec: size": "no package is shorter than its header",
    "rtde.fields: side": "not a number",
    "rtde.negotiation: self._in_vain": "more often than it is asked again",
    "simulator.interpreter: kind.count": "of a vector",
    "simulator.session: list_size(names)": "more than 2048",
}
"""Module and what is counted there -> why it is never 1."""


def _counts() -> Iterator[str]:
    for module in MODULES:
        for text in (node for node in nodes(module) if isinstance(node, ast.JoinedStr)):
            for number, words in zip(text.values, text.values[1:], strict=False):
                if isinstance(number, ast.FormattedValue) and isinstance(words, ast.Constant):
                    counted = ast.unparse(number.value)
                    if _BEFORE_A_NOUN.match(str(words.value)) and not _COUNTED.match(counted):
                        yield f"{module}: {counted}"


def test_numbers_before_a_noun_in_the_plural_are_never_one() -> None:
    assert set(_counts()) == set(NEVER_ONE)


_ONE_NOUN = "|".join(noun.removesuffix("s") for noun in _NOUNS.split("|"))
_AT_ODDS = re.compile(
    rf"\b[01] (?:more |mapping )?(?:{_NOUNS})\b|\b(?:0|no|[2-9]) (?:more |mapping )?(?:{_ONE_NOUN})\b|\b0\.0 s\b"
)


def _rtde(length: int) -> str:
    from_controller = (3 + length).to_bytes(2, "big") + b"U" + bytes(length)
    return package_text(from_controller, from_controller=True)


def _broken_rtde(length: int) -> str:
    """What a controller's client says of an answer that is too short."""
    package = (3 + length).to_bytes(2, "big") + b"O" + bytes(length)
    return " ".join(str(found) for found in ClientProtocol().receive(package))


_MISTAKE = Diagnostic(catalogue.complete()[0], "it is wrong", Position("a", 1, 1))


def _robot(count: int) -> Mapping[str, Any]:
    counted = "packages skipped late pauses overtaken sessions mismatches unadopted differing lag adoption"
    counters: dict[str, object] = dict.fromkeys(counted.split(), count)
    return counters | {"strange": {"layout": count}, "watchdog": None}


def _writes(count: int) -> Mapping[str, Any]:
    asked = {"age": 0.0, "text": "plc asked unit 7"}
    return {
        "writes": {"accepted": 2, "refused": 2},
        "last_refusal": {"age": 0.0, "text": "plc wrote start: refused"},
        "unserved": {"no_such_unit": count},
        "last_unserved": asked if count else None,
    }


def _repeated(count: int) -> str:
    """What is said of refusals that were counted, the last of them in this moment."""
    found: list[Event] = []
    log = RefusalLog(found.append)
    for _ in range(1 + count):
        log.add(Event(1.0, EventKind.REFUSED, reason=Reason.HELD, writer=0))
    log.tick(1.0 + REFUSAL_INTERVAL)
    return " ".join(_event(event.kind.value, event.repeats, detail=event.detail) for event in found)


def _event(what: str, times: int = 1, others: int = 0, detail: str = "") -> str:
    return EventRecord(what, "plc", "start", lock="start", times=times, others=others, detail=detail).text()


SENTENCES: dict[str, Callable[[int], str]] = {
    "bytes of an unknown kind of link": lambda n: TrafficDecoder().words(bytes(n), "", outgoing=False),
    "half a message": lambda n: RtdeTraffic().words(bytes(n), "", outgoing=False),
    "data package": _rtde,
    "short package": _broken_rtde,
    "NMT frame": lambda n: frame_text(Frame(0, bytes(n))),
    "EMCY": lambda n: frame_text(Frame(0x081, bytes(n))),
    "heartbeat": lambda n: frame_text(Frame(0x701, bytes(n))),
    "SDO request": lambda n: frame_text(Frame(0x601, bytes(n))),
    "SDO answer": lambda n: frame_text(Frame(0x581, bytes(n))),
    "SDO upload": lambda n: frame_text(Frame(0x581, bytes([0x41, 0x10, 0x20, 1, n, 0, 0, 0]))),
    "CAN error counters": lambda n: str(ErrorFrame(ErrorClass(0), ControllerFlags(0), Violation(0), n, n)),
    "read request": lambda n: request_text(bytes([3, 0, 0, 0, n])),
    "short read request": lambda n: request_text(bytes([3] + n * [0])),
    "write request": lambda n: request_text(bytes([16, 0, 0, 0, n, 2 * n, *bytes(2 * n)])),
    "write request without data": lambda n: request_text(bytes([15, 0, 0, 0, n, 9])),
    "answer": lambda n: answer_text(bytes([3, 2 * n, *bytes(2 * n)]), bytes([3, 0, 0, 0, n])),
    "adoption": lambda n: adopted(ProcessImage(()), n, ()),
    "merged writes": lambda n: _event(ACCEPTED, times=n),
    "merged refusals": lambda n: _event(EventKind.REFUSED.value, times=n),
    "several locks": lambda n: _event(EventKind.RELEASED.value, others=n),
    "several variables": lambda n: _event(EventKind.UNAVAILABLE.value, others=n),
    "files checked": lambda n: as_text(CheckOutcome(tuple("abc"[:n]), (), ())),
    "mistakes found": lambda n: as_text(CheckOutcome(("a",), n * (_MISTAKE,))),
    "status of the robot": lambda n: ", ".join(status._counts(_robot(n))),
    "status of a writer": lambda n: status._writer({"name": "plc", "alive": True, "age": 1.0, "locks": n}, n),
    "status of locks": lambda n: ", ".join(
        status._locks([{"name": "start", "owner": None} for _ in range(n)])
    ),
    "status of writes": lambda n: "; ".join(status._writes(_writes(n))),
    "status of variables": lambda n: status._variables({"total": n, "good": n}),
    "counted refusals": _repeated,
    "files not served": lambda n: "; ".join(Startup((), n, 0).notes),
}
"""What counts something -> the sentence for that many."""


@pytest.mark.parametrize("name", SENTENCES)
@pytest.mark.parametrize("count", [0, 1, 2])
def test_sentences_agree_with_what_they_count(name: str, count: int) -> None:
    sentence = SENTENCES[name](count)
    assert not _AT_ODDS.search(sentence), sentence
