"""Controller inputs that act through a mask: speed slider, digital, tool and analog outputs.

An input package leaves its values in the store under the inputs' own names. What they do then is written down here: a
bit of the mask that is set takes the matching bit or value over, everything else stays as it was.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping

from gatewayd.rtde.companions import COMPANIONS
from gatewayd.simulator.store import FieldStore

Effect = Callable[[FieldStore], None]
"""Makes the outputs follow the inputs that the store now holds."""

_MILLIAMPERES = (4.0, 16.0)  # at ratio 0, and the span to ratio 1
_VOLTS = (0.0, 10.0)
_FIRST_ANALOG_OUTPUT_TYPE = 2  # bit of analog_io_types


def effects(fields: Iterable[str]) -> tuple[Effect, ...]:
    """What must be called after these inputs were written, each once."""
    return tuple(dict.fromkeys(_EFFECTS[field] for field in fields if field in _EFFECTS))


def _integer(store: FieldStore, field: str) -> int:
    return int(store.read(field)[0]) if field in store else 0


def _take_bits(store: FieldStore, field: str, mask: int, bits: int) -> None:
    if field in store:
        store.write(field, ((_integer(store, field) & ~mask) | (bits & mask),))


def _speed_slider(store: FieldStore) -> None:
    fraction = store.read("speed_slider_fraction")[0]
    if _integer(store, "speed_slider_mask") & 1 and not math.isnan(fraction):
        store.write("target_speed_fraction", (min(max(fraction, 0.0), 1.0),))


def _digital(kind: str, shift: int, width: int, own_field: str | None = None) -> Effect:
    """Outputs of one kind, at bit `shift` of actual_digital_output_bits and from bit 0 of `own_field`."""

    def effect(store: FieldStore) -> None:
        mask = _integer(store, f"{kind}_digital_output_mask") & ((1 << width) - 1)
        bits = _integer(store, f"{kind}_digital_output")
        _take_bits(store, "actual_digital_output_bits", mask << shift, bits << shift)
        if own_field is not None:
            _take_bits(store, own_field, mask, bits)

    return effect


def _analog(store: FieldStore) -> None:
    mask = _integer(store, "standard_analog_output_mask")
    volts = _integer(store, "standard_analog_output_type")
    for number in (0, 1):
        ratio = store.read(f"standard_analog_output_{number}")[0]
        if not mask >> number & 1 or math.isnan(ratio):
            continue
        low, span = _VOLTS if volts >> number & 1 else _MILLIAMPERES
        store.write(f"standard_analog_output{number}", (low + span * min(max(ratio, 0.0), 1.0),))
        shift = _FIRST_ANALOG_OUTPUT_TYPE
        _take_bits(store, "analog_io_types", 1 << number + shift, volts << shift)


_BY_MASK: Mapping[str, Effect] = {
    "speed_slider_mask": _speed_slider,
    "standard_digital_output_mask": _digital("standard", 0, 8),
    "configurable_digital_output_mask": _digital(
        "configurable", 8, 8, "actual_configurable_digital_output_bits"
    ),
    "tool_digital_output_mask": _digital("tool", 16, 2),
    "standard_analog_output_mask": _analog,
}
_EFFECTS: Mapping[str, Effect] = {
    name: _BY_MASK[needs.mask]
    for value, needs in COMPANIONS.items()
    for name in (value, needs.mask, needs.type)
    if name is not None
}
