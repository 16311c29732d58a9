"""What everybody may know of this kind of link."""

from __future__ import annotations

from gatewayd.core.definition import CellDefinition
from gatewayd.core.status_layout import LINK_TABLES, LinkTable
from gatewayd.links.contract import Description, LinkKind, LinkMetric
from gatewayd.links.devices.description import description
from gatewayd.links.devices.plan import DevicePlan
from gatewayd.links.devices.status_words import MAX_DEVICES, STATUS_WORDS
from gatewayd.mapping.plan import LinkPlan


class DeviceKind(LinkKind):
    """The kind with the section `devices`: a link for each of them, under its name."""

    key = DevicePlan.kind
    title = "device"
    traffic = "gatewayd.links.devices.traffic"
    doctor = "gatewayd.links.devices.doctor"
    access = "gatewayd.links.devices.access"
    sheets = "gatewayd.links.devices.canopen.proposal"
    fields = {  # noqa: RUF012 - never changed
        "family": "how it is spoken to: `modbus`, `canopen`",
        "address": "where it is reached: host:port, serial port with its settings, or CAN bus",
        "unit": "unit id of a Modbus device, node-ID of a CANopen device, or null",
        "state": "`starting`, `good`, `partial` (some values are lost), `refusing` (it refuses everything), `lost`",
        "reason": "why it is not good, or empty",
        "since": "seconds for which it is in this state",
        "round_trip": "seconds from request to answer, of the last one, or null",
        "answers": "requests that were answered, exceptions as well",
        "timeouts": "requests that were not answered in time",
        "errors": "answers that could not be read, and connections that were lost or could not be had",
        "exceptions": "requests that the device refused, by code",
        "age": "seconds since its last answer, or null",
        "losses": "how often it was lost",
    }
    fields |= {
        "letter": "of a CANopen device: how its last boot went (CiA 302-2, A to O), or empty",
        "nmt_state": "its NMT state, or empty where it is not known",
        "identity": "what it says of itself: device type, vendor, product, revision, serial number",
        "boots": "how often it was taken into operation",
        "heartbeat_misses": "how often its heartbeat was missed",
        "emergencies": "EMCY messages that it sent",
        "emergency": "the last of them in words, or empty",
        "pdos_received": "PDOs that it sent and that were used",
        "pdos_sent": "PDOs that it was sent",
    }
    metrics = (
        LinkMetric("gatewayd_device_up", "up", "1 while the device answers, and not by refusals alone"),
        LinkMetric(
            "gatewayd_device_round_trip_seconds",
            "round_trip",
            "seconds from request to answer, of the last one",
        ),
        LinkMetric("gatewayd_device_answers_total", "answers", "requests that the device answered"),
        LinkMetric(
            "gatewayd_device_timeouts_total", "timeouts", "requests that the device did not answer in time"
        ),
        LinkMetric(
            "gatewayd_device_errors_total",
            "errors",
            "answers of the device that could not be read, and connections that were lost or could not be had",
        ),
        LinkMetric("gatewayd_device_losses_total", "losses", "times that the device was lost"),
        LinkMetric(
            "gatewayd_device_exceptions_total",
            "exceptions",
            "requests that the device refused",
            label="code",
        ),
    )
    status_tables = (
        LinkTable(
            LINK_TABLES,
            MAX_DEVICES * len(STATUS_WORDS),
            "devices",
            f"{len(STATUS_WORDS)} words for each of {MAX_DEVICES} devices, in the order of the file",
            STATUS_WORDS,
        ),
    )
    place = "list of its places in the device"

    def describe(self, plan: LinkPlan, cell: CellDefinition) -> Description:
        """In the words of its family."""
        assert isinstance(plan, DevicePlan)
        return description(plan, cell)

    def fits(self, old: LinkPlan, new: LinkPlan, before: CellDefinition, after: CellDefinition) -> bool:
        """Where it means the same: only the indices of its variables differ."""
        assert isinstance(old, DevicePlan)
        assert isinstance(new, DevicePlan)
        return old.family == new.family and old.identity(before) == new.identity(after)


KIND = DeviceKind()
"""What everybody may know of this kind of link."""
