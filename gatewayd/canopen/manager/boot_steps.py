"""The steps of the boot of a device, and what follows from the end of each, as a table (CiA 302-2, "boot slave")."""

from __future__ import annotations

from enum import Enum

from gatewayd.canopen.manager.letters import BootError


class BootStep(Enum):
    """Where a boot stands."""

    IDLE = "not begun"
    SETTLING = "lets the device start"
    TYPE = "asks for the device type"
    VENDOR = "asks for the vendor"
    PRODUCT = "asks for the product code"
    REVISION = "asks for the revision"
    SERIAL = "asks for the serial number"
    STATE = "looks whether the device is in operation"
    KEPT = "compares the PDOs of the running device"
    RESET = "resets its communication"
    SOFTWARE = "asks for the software version"
    DATE = "asks for the date of its configuration"
    CONFIGURE = "configures it"
    PDOS = "compares its PDOs"
    CONTENT = "reads what its outputs are"
    ERROR_CONTROL = "sets up its heartbeat"
    READY = "ready to be started"
    RUNNING = "started"
    FAILED = "failed"


class BootSignal(Enum):
    """How a step has ended."""

    GOOD = "as it should be"
    DIFFERENT = "answered otherwise than expected"
    REFUSED = "answered with an abort"
    SILENT = "not answered in time"
    FRESH = "has just booted"
    OPERATIONAL = "found in operation"
    OTHER = "found in another state"


def _failing(
    step: BootStep, letter: BootError, *signals: BootSignal
) -> dict[tuple[BootStep, BootSignal], BootError]:
    return {(step, signal): letter for signal in signals or (_DIFFERENT, _REFUSED, _SILENT)}


_GOOD, _DIFFERENT, _REFUSED, _SILENT = (
    BootSignal.GOOD,
    BootSignal.DIFFERENT,
    BootSignal.REFUSED,
    BootSignal.SILENT,
)
NEXT: dict[tuple[BootStep, BootSignal], BootStep | BootError] = {
    (BootStep.TYPE, _GOOD): BootStep.VENDOR,
    **_failing(BootStep.TYPE, BootError.NO_ANSWER, _SILENT, _REFUSED),
    **_failing(BootStep.TYPE, BootError.DEVICE_TYPE, _DIFFERENT),
    (BootStep.VENDOR, _GOOD): BootStep.PRODUCT,
    **_failing(BootStep.VENDOR, BootError.VENDOR),
    (BootStep.PRODUCT, _GOOD): BootStep.REVISION,
    **_failing(BootStep.PRODUCT, BootError.PRODUCT),
    (BootStep.REVISION, _GOOD): BootStep.SERIAL,
    **_failing(BootStep.REVISION, BootError.REVISION),
    (BootStep.SERIAL, _GOOD): BootStep.STATE,
    **_failing(BootStep.SERIAL, BootError.SERIAL),
    (BootStep.STATE, BootSignal.FRESH): BootStep.SOFTWARE,
    (BootStep.STATE, BootSignal.OPERATIONAL): BootStep.KEPT,
    (BootStep.STATE, BootSignal.OTHER): BootStep.RESET,
    **_failing(BootStep.STATE, BootError.HEARTBEAT, _SILENT, _REFUSED),
    (BootStep.KEPT, _GOOD): BootStep.CONTENT,
    (BootStep.KEPT, _DIFFERENT): BootStep.RESET,
    (BootStep.KEPT, _REFUSED): BootStep.RESET,
    (BootStep.KEPT, _SILENT): BootError.NO_ANSWER,
    (BootStep.RESET, _GOOD): BootStep.SOFTWARE,
    (BootStep.RESET, _SILENT): BootError.NO_ANSWER,
    (BootStep.SOFTWARE, _GOOD): BootStep.DATE,
    **_failing(BootStep.SOFTWARE, BootError.SOFTWARE),
    (BootStep.DATE, _GOOD): BootStep.PDOS,
    (BootStep.DATE, _DIFFERENT): BootStep.CONFIGURE,
    (BootStep.DATE, _REFUSED): BootStep.CONFIGURE,
    (BootStep.DATE, _SILENT): BootError.CONFIGURATION,
    (BootStep.CONFIGURE, _GOOD): BootStep.PDOS,
    **_failing(BootStep.CONFIGURE, BootError.CONFIGURATION),
    (BootStep.PDOS, _GOOD): BootStep.CONTENT,
    **_failing(BootStep.PDOS, BootError.CONFIGURATION),
    (BootStep.CONTENT, _GOOD): BootStep.ERROR_CONTROL,
    **_failing(BootStep.CONTENT, BootError.NO_ANSWER),
    (BootStep.ERROR_CONTROL, _GOOD): BootStep.READY,
    **_failing(BootStep.ERROR_CONTROL, BootError.HEARTBEAT_START),
}
"""What follows from the end of a step: the next one, or the letter with which the boot has failed."""
