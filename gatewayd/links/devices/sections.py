"""What devices have in the mapping language: the section `devices`, and the key `device` of variables and writers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Final, Literal

from gatewayd.links.devices.canopen.sections import CanopenDeviceKeys, CanopenPlaceKeys
from gatewayd.links.devices.modbus.sections import ModbusDeviceKeys, ModbusPlaceKeys
from gatewayd.mapping import syntax
from gatewayd.mapping.scalars import Duration, Name, OptionalDuration, refuse
from gatewayd.mapping.section import Section
from gatewayd.mapping.typed import BeforeValidator, Field

DEVICE_SELECTORS: Final = ("modbus", "serial", "canopen")
"""Keys of a device of which exactly one says what it is; those of all families."""
MAX_UNIT_OF_LINE: Final = 247
"""Greatest address on a serial line (Modbus over Serial Line V1.02, 2.2); 0 is a broadcast."""
PLACE_SELECTORS: Final = ("coil", "discrete", "input", "holding", "object")
"""Keys of a place of which exactly one says where it is; those of all families."""


class DeviceKeys(Section):
    """What every device has."""

    poll: Duration = Field(
        default=0.1, description="time between two reads of a value that says nothing else"
    )
    timeout: Duration = Field(default=0.5, description="time within which the device answers a request")
    lost_after: Duration | None = Field(
        default=None,
        description="time without an answer after which the device, or a value of it, counts as lost; "
        "default: three polls and a timeout (three with frames of a serial line), at least 1s",
    )
    watchdog: OptionalDuration = Field(
        default=None,
        description="time after which the device itself takes its outputs back when nobody asks it any more, "
        "as it is set up there; none: it has no watchdog",
    )


class DeviceSpec(DeviceKeys, ModbusDeviceKeys, CanopenDeviceKeys):
    """One device that the gateway talks to by itself."""

    schema_extra: ClassVar[Mapping[str, Any]] = {
        "oneOf": [{"required": [selector]} for selector in DEVICE_SELECTORS]
    }

    def judge(self) -> None:
        """Exactly one way to reach it."""
        given = [key for key in DEVICE_SELECTORS if getattr(self, key) is not None]
        if len(given) != 1:
            found = "none" if not given else " and ".join(given)
            message = f"a device has exactly one of {', '.join(DEVICE_SELECTORS)}; found {found}"
            refuse(syntax.MISSING_KEY, message, "write for example {modbus: 192.0.2.30:502, unit: 1}")
        is_rtu = self.serial is not None or self.framing == "rtu"
        if is_rtu and not 1 <= self.unit <= MAX_UNIT_OF_LINE:
            refuse(
                syntax.OUT_OF_RANGE,
                f"a unit on a serial line is between 1 and {MAX_UNIT_OF_LINE}, not {self.unit}",
                "write the address that is set at the device; 0 is all of them at once, and nobody answers",
            )
        if self.canopen is not None and self.node is None:
            message = "a CANopen device has a node-ID"
            refuse(
                syntax.MISSING_KEY, message, "write for example {canopen: can1, node: 5, eds: encoder.eds}"
            )

    @property
    def selector(self) -> str:
        """The key that says how it is reached."""
        return next(key for key in DEVICE_SELECTORS if getattr(self, key) is not None)


class PlaceKeys(Section):
    """What every place in a device has."""

    at: Name | None = Field(
        default=None, description="the device; not needed where the file has a single one"
    )
    poll: Duration | None = Field(
        default=None, description="inputs: time between two reads; default: as the device"
    )
    on_connect: Literal["wait", "write"] = Field(
        default="wait",
        description="outputs: when the device comes, wait for a change of the value, or write it at once",
    )
    every: Duration | None = Field(
        default=None,
        description="outputs: time after which the value is written again; default: only when it changes",
    )


class DevicePlaceSpec(PlaceKeys, ModbusPlaceKeys, CanopenPlaceKeys):
    """Where a variable lies in a device, and how its number is written there."""

    schema_extra: ClassVar[Mapping[str, Any]] = {
        "oneOf": [{"required": [selector]} for selector in PLACE_SELECTORS]
    }

    def judge(self) -> None:
        """Exactly one place."""
        given = [key for key in PLACE_SELECTORS if getattr(self, key) is not None]
        if len(given) != 1:
            found = "none" if not given else " and ".join(given)
            message = f"a place in a device names exactly one of {', '.join(PLACE_SELECTORS)}; found {found}"
            refuse(
                syntax.MISSING_KEY,
                message,
                "write for example {at: island, coil: 0}",
            )
        if given[0] in ModbusPlaceKeys.AREA_SELECTORS:
            self.judge_area()

    @property
    def selector(self) -> str:
        """The key that says where it is."""
        return next(key for key in PLACE_SELECTORS if getattr(self, key) is not None)


def _places(value: Any) -> Any:
    """Bring the short forms into one: `100`, `0.3`, `{coil: 5}`, or a list of them."""
    items = value if isinstance(value, (list, tuple)) else [value]
    return [
        item if isinstance(item, (dict, DevicePlaceSpec)) else {"holding": _present(item)} for item in items
    ]


def _present(item: Any) -> Any:
    if item is None or isinstance(item, (bool, list)):
        hint = "write {at: island, coil: 0}, or a holding register (100), a bit (100.3) or a byte (100.high) of it"
        refuse(syntax.WRONG_TYPE, "a place in a device is missing", hint)
    return item


class DevicePlaces(Section):
    """What a variable has in devices."""

    device: Annotated[
        tuple[DevicePlaceSpec, ...],
        BeforeValidator(
            _places,
            json_schema_input_type=float | str | DevicePlaceSpec | list[float | str | DevicePlaceSpec],
        ),
    ] = Field(
        default=(),
        description="where it lies in a device: {at: NAME, coil|discrete|input|holding: address, ...}, "
        "{at: NAME, object: index, ...}, or a list of these; an address alone is a holding register",
    )


class DeviceWriter(Section):
    """What a writer has that is a device."""

    device: Name | None = Field(default=None, description="the device that this writer is")
