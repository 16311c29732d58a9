"""What everybody may know of this kind of link."""

from __future__ import annotations

from collections.abc import Iterable

from gatewayd.core.definition import CellDefinition
from gatewayd.core.objection import Objection, ObjectionKind
from gatewayd.links.contract import Description, LinkKind, LinkMetric, Names
from gatewayd.links.robot.companions import all_inputs, all_outputs
from gatewayd.links.robot.plan import RobotPlan, WatchdogPlan
from gatewayd.mapping.plan import LinkPlan
from gatewayd.report.format import address, exact, seconds


class RobotKind(LinkKind):
    """The kind with the section `robot`."""

    key = RobotPlan.kind
    title = "Universal Robots controller"
    traffic = "gatewayd.links.robot.traffic"
    exports = "gatewayd.links.robot.urscript.export"
    doctor = "gatewayd.links.robot.doctor"
    usual = True
    stands_by = True
    fields = {  # noqa: RUF012 - never changed
        "address": "host:port of the controller",
        "state": "`lost`, `waiting`, `fresh`, `silent`, `frozen` or `late`",
        "writable": "connected, and its inputs were adopted",
        "age": "seconds since the last package that reported anything new, or null",
        "frequency": "packages per second, measured",
        "packages": "packages received",
        "skipped": "packages that the controller left out, being busy",
        "pauses": "times that the controller sent nothing for too long to count as skipping, while its clock went on",
        "overtaken": "packages that waited too long and were not shown: newer ones had come",
        "strange": "packages that could not be used as they were, by what was wrong with them: `unknown type`, "
        "`layout`, `recipe` (data of another one), `unexpected` (an answer to nothing)",
        "late": "packages that came late",
        "sessions": "sessions with the controller; the first one is not a reconnect",
        "mismatches": "inputs whose read-back differed from what was written",
        "lag": "seconds by which the newest package is later than the quickest ones were",
        "unadopted": "inputs whose content in the robot is not known",
        "differing": "inputs for which the robot holds something else than it was given",
        "adoption": "seconds until adopted inputs without an owner fall back; 0: none will",
        "watchdog": "whether the robot's watchdog is fed, or null without one",
        "controller": "software of the controller: `5.12.0.1101`, as it last said, or null",
        "series": "`cb3`, `e` or `x`, or null for another one",
        "protocol": "version of RTDE that is spoken, or null",
        "contradiction": "what the mapping says of the controller and it contradicts, in words, or null",
        "last_text": "last text message of the controller: `text`, `source`, `level` (`exception`, `error`, `warning`, "
        "`info`), `age`; or null",
        "unavailable": "list of `field`, `reason` and `variables` (names) that the controller does not give",
        "held_elsewhere": "list of inputs that another client holds: `field`, and who it `probably` is",
    }

    metrics = (
        LinkMetric(
            "gatewayd_robot_pauses_total",
            "pauses",
            "times the controller sent nothing while its clock went on",
        ),
        LinkMetric(
            "gatewayd_robot_packages_overtaken_total",
            "overtaken",
            "packages that waited too long and were not shown, newer ones had come",
        ),
        LinkMetric(
            "gatewayd_robot_strange_packages_total",
            "strange",
            "packages of the controller that could not be used as they were, by what was wrong with them",
            label="oddity",
        ),
    )

    def fits(self, old: LinkPlan, new: LinkPlan, before: CellDefinition, after: CellDefinition) -> bool:
        """The session goes on where its settings and claimed inputs are the same, and all outputs are subscribed."""
        assert isinstance(old, RobotPlan)
        assert isinstance(new, RobotPlan)
        return (
            _session_of(old) == _session_of(new)
            and set(all_inputs(old.inputs, before.variables)) == set(all_inputs(new.inputs, after.variables))
            and set(all_outputs(new.outputs, after.variables)).issubset(
                all_outputs(old.outputs, before.variables)
            )
        )

    def describe(self, plan: LinkPlan, cell: CellDefinition) -> Description:
        """Settings and address. Places have none: what a variable is in the robot, the definition of the cell says."""
        # Words for people, which neither a check nor a start needs.
        from gatewayd.rtde.enums import BITS, meanings  # noqa: PLC0415

        assert isinstance(plan, RobotPlan)
        where = address(plan.host, plan.port)
        return Description(
            settings={
                "host": plan.host,
                "port": str(plan.port),
                "frequency": f"{exact(plan.frequency)} Hz" if plan.frequency else "the controller's own",
                "stale_after": seconds(cell.stale_after),
                "on_connect": "fallback" if cell.clear_on_connect else "adopt",
                "adopt_for": seconds(cell.adopt_for) or "none",
                "verify": str(plan.verify).lower(),
                "watchdog": _watchdog(plan.watchdog, cell),
                "series": plan.series or "",
                "version": plan.version or "",
                "declared types": Names(" ".join(f"{name}:{word}" for name, word in sorted(plan.types))),
                "subscribed": Names(" ".join(sorted(plan.outputs))),
                "claimed": Names(" ".join(sorted(plan.inputs))),
            },
            meanings={
                index: found
                for index, variable in enumerate(cell.variables)
                if (found := meanings(variable.field, variable.bit))
            },
            bits={
                index: {bit: words.on for bit, words in BITS[variable.field].items()}
                for index, variable in enumerate(cell.variables)
                if variable.bit is None and variable.field in BITS
            },
            address=where,
            fields={"address": where},
        )

    def moved(self, old: LinkPlan, new: LinkPlan) -> bool:
        """Another address is another robot."""
        assert isinstance(old, RobotPlan)
        assert isinstance(new, RobotPlan)
        return (old.host, old.port) != (new.host, new.port)

    def disturbs(
        self, old: LinkPlan, new: LinkPlan, before: CellDefinition, after: CellDefinition
    ) -> Iterable[Objection]:
        """What the watchdog and the comparison by reading back promise, and feeding that pauses for a new session."""
        assert isinstance(old, RobotPlan)
        assert isinstance(new, RobotPlan)
        if old.verify and not new.verify:
            yield Objection(
                ObjectionKind.WEAKENING,
                "inputs that the robot holds differently would no longer be noticed: verify",
            )
        if old.watchdog is None:
            return
        text = _weaker_watchdog(old.watchdog, new.watchdog, before, after)
        if text:
            yield Objection(ObjectionKind.WEAKENING, text)
        if new.watchdog is not None and not self.fits(old, new, before, after):
            yield Objection(
                ObjectionKind.WATCHDOG,
                f"a new session with the robot begins, and {old.watchdog.field} is not fed until then",
            )


def _watchdog(watchdog: WatchdogPlan | None, cell: CellDefinition) -> str:
    if watchdog is None:
        return ""
    required = "".join(f", requires {cell.writers[writer].name}" for writer in watchdog.requires)
    return f"{watchdog.field} at {exact(watchdog.frequency)} Hz{required}"


def _weaker_watchdog(
    old: WatchdogPlan, new: WatchdogPlan | None, before: CellDefinition, after: CellDefinition
) -> str:
    """What a watchdog would no longer stand for, in words."""
    if new is None:
        return f"the robot program would not be watched any more: watchdog {old.field}"
    if new.field != old.field:
        return f"the robot program's watchdog would not be fed any more: {old.field} -> {new.field}"
    if new.frequency < old.frequency:
        rates = f"{exact(old.frequency)} Hz -> {exact(new.frequency)} Hz"
        return f"the robot program's watchdog would be fed less often: {rates}"
    required = {after.writers[writer].name for writer in new.requires}
    gone = [name for name in (before.writers[writer].name for writer in old.requires) if name not in required]
    return f"the watchdog would be fed without {', '.join(gone)}" if gone else ""


def _session_of(plan: RobotPlan) -> tuple[object, ...]:
    """The settings that a session is made with."""
    watchdog = plan.watchdog
    fed = (watchdog.field, watchdog.frequency) if watchdog is not None else None
    return plan.host, plan.port, plan.frequency, plan.verify, fed


KIND = RobotKind()
"""What everybody may know of this kind of link."""
