"""From an expanded node without errors to its plan."""

from __future__ import annotations

from gatewayd.canopen.heartbeat import Consumer
from gatewayd.canopen.sync import SyncPlan
from gatewayd.links.canopen_node.expand import CanopenCell, ExpandedPdo
from gatewayd.links.canopen_node.plan import GUARDING, CanopenPlan, IdentityPlan, PdoEntry, PdoPlan
from gatewayd.links.canopen_node.sections import ERROR_BEHAVIOURS, CanopenWriter
from gatewayd.mapping.expanded import ExpandedCell


def compile_canopen(cell: ExpandedCell, node: CanopenCell) -> CanopenPlan:
    """The plan of a node without errors."""
    spec = node.part.spec
    writers = [part.spec.by(CanopenWriter) for part in cell.document.writers.values()]
    own = {name: index for index, writer in enumerate(writers) for name in writer.pdos}
    return CanopenPlan(
        interface=spec.interface,
        channel=spec.channel,
        bitrate=spec.bitrate,
        node=spec.node,
        autostart=spec.autostart,
        heartbeat=_ticks(spec.heartbeat, 1000),
        sync=SyncPlan(
            spec.sync.cob_id,
            spec.sync.producer,
            _ticks(spec.sync.period, 1_000_000),
            spec.sync.counter,
            _ticks(spec.sync.window, 1_000_000),
        ),
        consumers=tuple(
            Consumer(writer.node, _ticks(writer.heartbeat, 1000), index)
            for index, writer in enumerate(writers)
            if writer.node is not None and writer.heartbeat is not None
        ),
        objects=tuple(placed.plan for placed in node.objects),
        pdos=tuple(_pdo(pdo, own.get(pdo.name)) for pdo in node.pdos),
        rpdo_writer=next(
            (index for index, writer in enumerate(writers) if writer.by_rpdo and not writer.pdos), None
        ),
        sdo_writer=next((index for index, writer in enumerate(writers) if writer.by_sdo), None),
        guarded=tuple(
            Consumer(GUARDING, _ticks(writer.guarding, 1000), index)
            for index, writer in enumerate(writers)
            if writer.guarding is not None
        ),
        guard_time=_ticks(spec.guarding.time, 1000),
        life_time_factor=spec.guarding.factor if spec.guarding.time is not None else 0,
        emcy_inhibit=_ticks(spec.emcy.inhibit, 10_000),
        error_behaviour=ERROR_BEHAVIOURS.index(spec.on_communication_error),
        identity=IdentityPlan(
            vendor=spec.identity.vendor,
            product=spec.identity.product,
            revision=spec.identity.revision,
            serial=spec.identity.serial,
        ),
    )


def _pdo(pdo: ExpandedPdo, writer: int | None) -> PdoPlan:
    assert pdo.slot.cob_id is not None
    return PdoPlan(
        number=pdo.slot.number,
        direction=pdo.direction,
        cob_id=pdo.slot.cob_id,
        predefined=pdo.slot.predefined,
        transmission=pdo.transmission,
        inhibit=_ticks(pdo.inhibit, 10_000),
        event=_ticks(pdo.event, 1000),
        entries=(
            *(
                PdoEntry(None, word.index, word.subindex, word.type.bits, word.quality_of)
                for word in pdo.status
            ),
            *(
                PdoEntry(placed.variable, placed.plan.index, placed.plan.subindex, placed.plan.type.bits)
                for placed in pdo.entries
            ),
        ),
        sync_start=pdo.sync_start,
        writer=writer,
        name=pdo.name,
    )


def _ticks(seconds: float | None, per_second: int) -> int:
    """A time as CANopen counts it; 0 for none."""
    return 0 if seconds is None else round(seconds * per_second)
