"""The JSON that the page polls."""

from __future__ import annotations

import json
import time
from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest

from gatewayd.core.events import Event, EventKind
from gatewayd.core.forcing import Holder
from gatewayd.links.canopen_node.plan import CanopenPlan, canopen_of
from gatewayd.mapping.loader import load
from gatewayd.service.cell_runtime import CellRuntime
from gatewayd.service.daemon import Daemon
from gatewayd.web.probes import Probes
from gatewayd.web.view import EVENTS, as_json, layout, overview, past, state
from tests.control.served import plan
from tests.web.press import CYCLES, FORCE_LIMIT, PLC, SPARE, START


def ran(steps: Generator[None, None, bytes]) -> list[bytes]:
    """What the steps return."""
    found: list[bytes] = []

    def collect() -> Generator[None, None, None]:
        found.append((yield from steps))

    list(collect())
    return found


def told(runtime: CellRuntime, probes: Probes, since: int = 0) -> Any:
    return json.loads(as_json(state(runtime, probes, since, time.monotonic())))


def test_overview_names_the_cells_and_tells_how_they_are(runtime: CellRuntime, probes: Probes) -> None:
    [cell] = json.loads(as_json(overview(probes, "1", time.monotonic())))["cells"]
    assert (cell["name"], cell["level"]) == ("press", "bad")
    assert cell["words"] == "Modbus 127.0.0.1:15020: not listening, see the log"
    runtime.cell.robot_lost("refused", time.monotonic())
    [cell] = json.loads(as_json(overview(probes, "1", time.monotonic())))["cells"]
    assert cell["words"].startswith("robot not connected")


def test_layout_has_both_addresses_of_every_place(runtime: CellRuntime) -> None:
    found = json.loads(as_json(layout(runtime)))
    start, force_limit, spare, cycles = found["variables"][:4]
    place = {"link": "modbus", "area": "holding", "address": "0.3", "notation": "400001.3", "type": "bit"}
    assert start["places"] == [place]
    assert [(one["address"], one["notation"]) for one in cycles["places"]] == [
        ("110", "400111"),
        ("8", "300009"),
    ]
    assert (start["robot"], force_limit["limits"], force_limit["unit"]) == (
        "input_bit_register_0",
        [0, 150],
        "N",
    )
    assert found["locks"][spare["lock"]]["owners"] == ["line"]
    assert found["locks"][force_limit["lock"]] == {
        "name": "force_limit",
        "owners": ["plc", "hmi"],
        "takeover": True,
        "lease": 5.0,
        "variables": ["force_limit"],
    }


def test_a_place_without_a_bit_has_none_in_its_addresses(tmp_path: Path) -> None:
    (door,) = [one for one in plan().cell.variables if one.name == "door"]
    found = json.loads(as_json(layout(CellRuntime(plan(), tmp_path, 0.0))))["variables"][door.number - 1]
    place = {"link": "modbus", "area": "discrete", "address": "64", "notation": "100065", "type": "bit"}
    assert (found["name"], found["places"]) == ("door", [place])


def test_state_has_a_column_entry_for_every_variable(runtime: CellRuntime, probes: Probes) -> None:
    found, count = told(runtime, probes), len(runtime.cell.definition.variables)
    assert [len(found[column]) for column in ("values", "quality", "ages")] == [count] * 3
    assert found["values"][FORCE_LIMIT] == 12.5
    assert (found["quality"][SPARE], found["ages"][SPARE]) == (2, None)
    assert 0 <= found["ages"][CYCLES] < 5000
    assert found["fingerprint"] == json.loads(as_json(layout(runtime)))["fingerprint"]


def test_owned_locks_tell_owner_and_what_is_left(runtime: CellRuntime, probes: Probes) -> None:
    start, force_limit = told(runtime, probes)["owned"]
    assert start == [0, PLC, None, ""]
    assert force_limit[:2] == [1, PLC]
    assert 0 < force_limit[2] <= 5000


def test_a_forced_output_tells_the_age_of_its_force(runtime: CellRuntime, probes: Probes) -> None:
    now = time.monotonic()
    runtime.cell.operator.force(CYCLES, 77, now - 1, now + 60, holder=Holder("anna", "a key"))
    found = told(runtime, probes)
    assert (found["values"][CYCLES], found["quality"][CYCLES]) == (77, 4)
    assert found["ages"][CYCLES] >= 1000
    [[index, left, reported, quality, holder]] = found["forced"]
    assert (index, reported, quality) == (CYCLES, 0, 0), "the truth beside it"
    assert holder == "token anna"
    assert 0 < left <= 60_000


def test_the_last_minute_is_told_from_the_oldest_sample_on(runtime: CellRuntime, probes: Probes) -> None:
    start = time.monotonic()
    runtime.cell.image.values[CYCLES] = 42
    probes.look(start + 1.0)
    runtime.cell.image.values[CYCLES] = float("nan")
    probes.look(start + 1.5)
    [answer] = ran(past(runtime, probes, start + 3.0))
    found = json.loads(answer)
    assert found["period"] == 500
    values = [(sample["age"], sample["values"][CYCLES]) for sample in found["samples"]]
    assert values[-2:] == [(2000, 42.0), (1500, "NaN")]
    assert all(len(sample["quality"]) == len(runtime.cell.image.values) for sample in found["samples"])


def test_picture_is_as_bad_as_its_worst_part(runtime: CellRuntime, probes: Probes) -> None:
    picture = told(runtime, probes)["picture"]
    assert picture["level"] == "bad"
    assert picture["buses"] == [
        {"name": "Modbus 127.0.0.1:15020", "level": "bad", "words": "not listening, see the log", "facts": ""}
    ]
    assert [one["name"] for one in picture["writers"]] == ["plc", "hmi", "line"]


def test_only_events_that_are_new_come_again(runtime: CellRuntime, probes: Probes) -> None:
    first = told(runtime, probes)["events"]
    assert first["latest"][-1]["number"] == first["count"]
    assert first["latest"][-1]["text"].startswith("hmi wrote start = 0: refused")
    assert told(runtime, probes, first["count"])["events"]["latest"] == []
    runtime.cell.events.append(Event(1.0, EventKind.FRESH))
    again = told(runtime, probes, first["count"])["events"]
    assert [(one["number"], one["bad"]) for one in again["latest"]] == [(first["count"] + 1, False)]


def test_a_lost_plc_is_not_buried_under_its_fallbacks(runtime: CellRuntime, probes: Probes) -> None:
    """What one deed did to many variables is one entry; another moment or another writer is another."""
    ring = runtime.cell.events
    known = ring.count
    ring.append(Event(1.0, EventKind.WRITER_LOST, writer=PLC, detail="closed"))
    for _ in range(2 * EVENTS):
        ring.append(Event(1.0, EventKind.RELEASED, lock=0, writer=PLC, detail="owner lost: closed"))
    ring.append(Event(1.0, EventKind.FALLBACK, variable=START, new=False))
    ring.append(Event(1.0, EventKind.FALLBACK, variable=FORCE_LIMIT, new=0.0))
    ring.append(Event(1.5, EventKind.FALLBACK, variable=SPARE, old=9, new=7))
    found = told(runtime, probes, known)["events"]
    assert [one["text"] for one in found["latest"]] == [
        "writer plc lost: closed",
        f"plc no longer holds start and {2 * EVENTS - 1} more: owner lost: closed",
        "start and 1 more fell back",
        "spare fell back from 9 to 7",
    ]
    assert found["latest"][-1]["number"] == found["count"] == ring.count


@pytest.mark.parametrize("since", [-5, 10**9])
def test_a_page_from_another_life_of_the_gateway_gets_everything(
    runtime: CellRuntime, probes: Probes, since: int
) -> None:
    found = told(runtime, probes, since)["events"]
    assert len(found["latest"]) == len(told(runtime, probes)["events"]["latest"])
    assert found["latest"][0]["text"].startswith("robot connected")


def test_answers_are_bounded(runtime: CellRuntime, probes: Probes) -> None:
    for _ in range(3 * EVENTS):
        runtime.cell.events.append(Event(1.0, EventKind.FRESH))
    assert len(told(runtime, probes)["events"]["latest"]) == EVENTS


def test_what_json_does_not_know_becomes_text(runtime: CellRuntime, probes: Probes) -> None:
    values = runtime.cell.image.values
    values[4:7] = [float("nan"), float("inf"), float("-inf")]
    assert told(runtime, probes)["values"][4:7] == ["NaN", "Infinity", "-Infinity"]


def test_an_object_stands_beside_the_registers(tmp_path: Path) -> None:
    mapping = Path(__file__).parents[2] / "mappings" / "two-buses.yaml"
    plan = load(mapping.read_bytes(), mapping.name).plan
    assert plan is not None
    shown = json.loads(json.dumps(layout(CellRuntime(plan, tmp_path, 0.0))))
    areas = {place["area"] for one in shown["variables"] for place in one["places"]}
    assert {"holding", "object"} <= areas
    objects = [place for one in shown["variables"] for place in one["places"] if place["area"] == "object"]
    assert any(place["notation"].startswith("COB-ID 0x") for place in objects)


def test_a_can_bus_is_named_and_tells_its_node(tmp_path: Path) -> None:
    mapping = Path(__file__).parents[2] / "mappings" / "canopen-only.yaml"
    plan = load(mapping.read_bytes(), mapping.name).plan
    assert plan is not None
    assert canopen_of(plan) is not None
    daemon = Daemon([plan], tmp_path)
    [bus] = told(daemon.runtimes[0], Probes(daemon))["picture"]["buses"]
    assert (bus["name"], bus["level"]) == (f"CAN {plan.the(CanopenPlan).channel}", "bad")
    assert bus["facts"] == f"node {plan.the(CanopenPlan).node}, initialising"
