"""Questions and acts: what they answer, what they do to the cell, and what is refused how."""

from __future__ import annotations

from typing import Any

import pytest

from gatewayd.audit.trail import Audit
from gatewayd.control.access import local_caller
from gatewayd.control.api import NEWS, Api, ApiError, Cursor
from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.definition import OPERATOR
from gatewayd.core.events import Event, EventKind
from gatewayd.core.image import Quality
from gatewayd.core.requester import Requester
from tests.control.served import LIMIT, PATH, SPEED, FixedGateway, Served, at, bring_up, plan
from tests.works import finished

PLC = 0
BY = local_caller("anna")


def refused(status: int, code: str, act: Any, *args: Any) -> str:
    with pytest.raises(ApiError) as caught:
        act(*args)
    assert (caught.value.status, caught.value.code) == (status, code)
    assert caught.value.as_json()["error"]["code"] == code
    return caught.value.message


class TestStatus:
    def test_is_healthy_only_if_the_gateway_itself_is(self, api: Api, gateway: FixedGateway) -> None:
        assert finished(api.status(at(0.1)))["healthy"]
        gateway.wrong = ["not listening on 127.0.0.1:1502"]
        status = finished(api.status(at(0.1)))
        assert not status["healthy"]
        assert status["problems"] == ["not listening on 127.0.0.1:1502"]

    def test_names_the_cell_of_a_problem(self, api: Api, press: Served) -> None:
        press.cell.robot_lost("gone", 1.0)
        assert finished(api.status(at(2.0)))["problems"] == ["press: robot not connected for 2 s"]

    def test_tells_standing_notes(self, gateway: FixedGateway, audit: Audit) -> None:
        api = Api(gateway, audit, lambda: ["1 mapping file not served, see the log"])
        assert not finished(api.status(at(0.1)))["healthy"]

    def test_needs_no_cell(self, audit: Audit) -> None:
        status = finished(Api(FixedGateway([]), audit).status(at(5.0)))
        assert (status["cells"], status["uptime"]) == ([], 0.0)


class TestQuestions:
    def test_names_may_have_wildcards(self, api: Api) -> None:
        names = [one["name"] for one in finished(api.variables({"name": "tcp*"}, at(1.0)))["variables"]]
        assert names == [f"tcp[{n}]" for n in range(6)]

    def test_a_name_with_brackets_means_itself(self, api: Api) -> None:
        names = [one["name"] for one in finished(api.variables({"name": "tcp[3]"}, at(1.0)))["variables"]]
        assert names == ["tcp[3]"]

    def test_a_pattern_is_bounded(self, api: Api) -> None:
        message = refused(400, "bad_query", lambda: finished(api.variables({"name": "*" * 4096}, at(1.0))))
        assert message == "`name` has 4096 characters, at most 128 are allowed"

    def test_a_list_is_of_one_moment_however_long_it_takes(self, api: Api, press: Served) -> None:
        assert press.cell.write(Requester(PLC), [Change(SPEED, 1.0), Change(PATH, 1)], 1.0) is None
        work = api.variables({}, at(1.0))
        next(work)
        assert press.cell.write(Requester(PLC), [Change(SPEED, 2.0), Change(PATH, 2)], 1.1) is None
        found = {one["name"]: one["value"] for one in finished(work)["variables"]}
        assert (found["speed"], found["path"]) == (1.0, 1)

    def test_an_unknown_cell_names_the_known(self, api: Api) -> None:
        message = refused(404, "no_such_cell", lambda: finished(api.variables({"cell": "pres"}, at(1.0))))
        assert message == "there is no cell pres, only press"

    def test_a_reloaded_mapping_is_seen(self, api: Api, press: Served) -> None:
        assert finished(api.variables({"name": "cycles"}, at(1.0)))["variables"]
        press.plan = plan(extra="parts")
        press.cell = Cell(press.plan.cell)
        assert not finished(api.variables({"name": "cycles"}, at(1.0)))["variables"]
        assert finished(api.variables({"name": "parts"}, at(1.0)))["variables"]

    def test_locks(self, api: Api, press: Served) -> None:
        assert press.cell.write(Requester(PLC), [Change(SPEED, 1.0)], 1.0) is None
        locks = {one["name"]: one for one in finished(api.locks({}, at(1.5)))["locks"]}
        assert locks["motion"] == {
            "cell": "press",
            "name": "motion",
            "members": ["speed", "path"],
            "owners": ["plc", "hmi"],
            "takeover": True,
            "declared_lease": 2.0,
            "owner": "plc",
            "remaining": 1.5,
            "by": None,
        }
        assert locks["start"]["owner"] is None

    def test_the_audit_is_filtered_and_limited(self, api: Api, press: Served) -> None:
        for turn in range(5):
            assert press.cell.write(Requester(PLC), [Change(LIMIT, float(turn + 1))], turn * 10.0) is None
        records = finished(api.audit({"variable": "limit", "writer": "plc", "limit": "2"}, at(50.0)))[
            "records"
        ]
        assert [(one["old"], one["new"]) for one in records] == [(3.0, 4.0), (4.0, 5.0)]
        assert finished(api.audit({"limit": "0"}, at(50.0)))["records"] == []
        assert finished(api.audit({"writer": "hmi"}, at(50.0)))["records"] == []


class TestEvents:
    def test_the_last_ones_oldest_first_with_wall_clock(self, api: Api, press: Served) -> None:
        press.cell.robot_lost("gone", 5.0)
        events = finished(api.events({"limit": "2"}, at(9.0)))["events"]
        count = press.cell.events.count
        assert [(one["seq"], one["event"]) for one in events] == [
            (count - 1, "robot values fresh"),
            (count, "robot lost"),
        ]
        assert events[-1]["time"] == "2027-01-15T08:00:05.000Z"

    def test_one_kind_whatever_else_happened(self, api: Api, press: Served) -> None:
        press.cell.robot_lost("gone", 5.0)
        for _ in range(5000):
            press.cell.events.append(Event(6.0, EventKind.ACQUIRED, lock=0, writer=PLC))
        (lost,) = finished(api.events({"kind": "robot lost"}, at(9.0)))["events"]
        assert lost["text"] == "robot lost: gone"
        message = refused(400, "bad_query", lambda: finished(api.events({"kind": "lost"}, at(9.0))))
        assert message.startswith("`kind` must be one of: robot connected, robot lost, ")

    def test_after_a_number(self, api: Api, press: Served) -> None:
        count = press.cell.events.count
        press.cell.robot_lost("gone", 5.0)
        events = finished(api.events({"after": str(count), "cell": "press"}, at(9.0)))["events"]
        assert events[0]["seq"] == count + 1

    @pytest.mark.parametrize("limit", ["-1", "x", "1001", "1.5", "٣", "9" * 5000])
    def test_a_bad_number_is_refused(self, api: Api, limit: str) -> None:
        refused(400, "bad_query", lambda: finished(api.events({"limit": limit}, at(1.0))))

    def test_a_cursor_tells_each_event_once(self, api: Api, press: Served) -> None:
        cursor = Cursor()
        assert api.new_events(cursor, {}, at(1.0)) == []
        press.cell.robot_lost("gone", 2.0)
        assert api.new_events(cursor, {}, at(2.0))[0]["event"] == "robot lost"
        assert api.new_events(cursor, {}, at(3.0)) == []

    def test_a_follower_gets_what_is_much_in_parts(self, api: Api, press: Served) -> None:
        cursor = Cursor()
        api.new_events(cursor, {}, at(1.0))
        for number in range(NEWS + 5):
            press.cell.events.append(Event(2.0, EventKind.FRESH, detail=str(number)))
        assert api.has_news(cursor, {})
        found = [api.new_events(cursor, {}, at(3.0)) for _ in range(3)]
        assert [len(part) for part in found] == [NEWS, 5, 0]
        assert [one["detail"] for part in found for one in part] == [
            str(number) for number in range(NEWS + 5)
        ]
        assert not api.has_news(cursor, {})

    def test_a_cursor_survives_a_reload(self, api: Api, press: Served) -> None:
        cursor = Cursor()
        api.new_events(cursor, {}, at(1.0))
        press.cell = Cell(press.plan.cell)
        press.cell.robot_connected(2.0)
        assert [one["event"] for one in api.new_events(cursor, {}, at(2.0))] == ["robot connected"]


class TestLocks:
    def test_take_names_who_did_it(self, api: Api, press: Served) -> None:
        assert press.cell.write(Requester(PLC), [Change(SPEED, 1.0)], 1.0) is None
        lock = api.take("motion", {"for": 10}, BY, at(1.0))
        assert (lock["owner"], lock["remaining"], lock["by"]) == ("operator", 10.0, "anna")
        taken = [event for event in press.cell.events if event.kind is EventKind.TAKEN_OVER]
        assert [event.detail for event in taken] == [BY.detail]
        assert press.cell.image.values[SPEED] == 0.5, "it is the command of the PLC no more"

    def test_a_variable_names_its_lock(self, api: Api, press: Served) -> None:
        assert api.take("path", {}, BY, at(1.0))["name"] == "motion"
        assert press.cell.ownership.owners[2] == OPERATOR

    def test_release_applies_the_fallback(self, api: Api, press: Served) -> None:
        assert press.cell.write(Requester(PLC), [Change(SPEED, 1.0)], 1.0) is None
        assert api.release("motion", {}, BY, at(1.0))["owner"] is None
        assert press.cell.image.values[SPEED] == 0.5

    def test_what_is_free_cannot_be_released(self, api: Api) -> None:
        refused(409, "not_owned", api.release, "motion", {}, BY, at(1.0))

    def test_an_output_has_no_lock(self, api: Api) -> None:
        refused(404, "no_such_lock", api.take, "cycles", {}, BY, at(1.0))

    @pytest.mark.parametrize("seconds", [0, -1, "5", True, float("nan"), 10**9, [], 10**400])
    def test_a_bad_time_is_refused(self, api: Api, seconds: object) -> None:
        refused(400, "bad_request", api.take, "motion", {"for": seconds}, BY, at(1.0))


class TestForce:
    def test_an_input_reaches_the_robot(self, api: Api, press: Served) -> None:
        found = api.force("limit", {"value": 42, "for": 30}, BY, at(1.0))
        assert (found["value"], found["quality"], found["owner"], found["lease"]) == (
            42.0,
            "forced",
            "operator",
            30.0,
        )
        assert press.cell.image.quality[LIMIT] is Quality.FORCED
        assert isinstance(press.cell.image.values[LIMIT], float)

    def test_a_time_limit_is_required(self, api: Api) -> None:
        refused(400, "bad_request", api.force, "limit", {"value": 42}, BY, at(1.0))

    def test_limits_are_named(self, api: Api) -> None:
        message = refused(409, "out_of_limits", api.force, "limit", {"value": 151, "for": 1}, BY, at(1.0))
        assert message == "limit cannot be forced: value out of limits, 0..150"

    def test_without_a_robot_an_input_cannot_be_forced(self, api: Api, press: Served) -> None:
        press.cell.robot_lost("gone", 0.5)
        refused(409, "robot_lost", api.force, "limit", {"value": 1, "for": 1}, BY, at(1.0))

    @pytest.mark.parametrize(
        "name, value",
        [
            ("start", 2), ("start", "1"), ("start", None), ("cycles", 1.5), ("cycles", True), ("cycles", "7"),
            ("cycles", float("inf")), ("limit", "1"), ("limit", float("nan")), ("limit", 10**400), ("limit", [1]),
        ],
    )  # fmt: skip
    def test_a_value_of_another_kind_is_refused(self, api: Api, name: str, value: object) -> None:
        refused(400, "bad_value", api.force, name, {"value": value, "for": 1}, BY, at(1.0))

    @pytest.mark.parametrize(
        "name, value, meant",
        [("start", 1, True), ("start", False, False), ("cycles", 3.0, 3), ("limit", 3, 3.0)],
    )
    def test_values_become_the_variables_kind(
        self, api: Api, name: str, value: object, meant: object
    ) -> None:
        held = api.force(name, {"value": value, "for": 1}, BY, at(1.0))["value"]
        assert (held, type(held)) == (meant, type(meant))

    def test_unforce(self, api: Api) -> None:
        api.force("cycles", {"value": 99, "for": 30}, BY, at(1.0))
        assert api.unforce("cycles", {}, BY, at(2.0))["value"] == 1
        refused(409, "not_forced", api.unforce, "cycles", {}, BY, at(3.0))

    def test_an_unknown_name(self, api: Api) -> None:
        refused(404, "no_such_variable", api.force, "nothing", {"value": 1, "for": 1}, BY, at(1.0))


class TestSeveralCells:
    @pytest.fixture
    def api(self, press: Served, audit: Audit) -> Api:
        second = plan("weld", 1503)
        other = Served(second, Cell(second.cell))
        bring_up(other.cell, 0.0)
        return Api(FixedGateway([press, other]), audit)

    def test_a_name_of_both_must_say_which(self, api: Api) -> None:
        message = refused(409, "ambiguous", api.take, "start", {}, BY, at(1.0))
        assert message == "start is in several cells (press, weld): say which with `cell`"
        assert api.take("start", {"cell": "weld"}, BY, at(1.0))["cell"] == "weld"

    def test_after_needs_the_cell(self, api: Api) -> None:
        refused(400, "bad_query", lambda: finished(api.events({"after": "1"}, at(1.0))))

    def test_events_of_all_by_time(self, api: Api) -> None:
        cells = {one["cell"] for one in finished(api.events({}, at(1.0)))["events"]}
        assert cells == {"press", "weld"}

    @pytest.mark.parametrize("cell", [1, None, ["x"]])
    def test_a_cell_is_a_text(self, api: Api, cell: object) -> None:
        with pytest.raises(ApiError):
            api.take("start", {"cell": cell}, BY, at(1.0))
