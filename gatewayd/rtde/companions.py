"""Which controller input acts through which: masks that select, and types that say what a number means.

A value whose mask bit is not set in the same package does nothing; a mask bit that is set acts again with every package
of its recipe, also when it goes out for another value. An analog output is a ratio of the span that its type selects:
4 to 20 mA or 0 to 10 V.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True, slots=True)
class Companions:
    """What a value needs besides itself to act as it is meant."""

    mask: str
    """The mask field."""
    bit: int | None = None
    """Its bit for the whole value; None: bit for bit, each bit of the mask stands for the same bit of the value."""
    type: str | None = None
    """The field whose same bit selects the domain: 0 current, 1 voltage; None: the value has only one meaning."""


_DIGITAL = ("standard", "configurable", "tool")

COMPANIONS: Mapping[str, Companions] = MappingProxyType(
    {
        "speed_slider_fraction": Companions("speed_slider_mask", 0),
        **{f"{kind}_digital_output": Companions(f"{kind}_digital_output_mask") for kind in _DIGITAL},
        **{
            f"standard_analog_output_{number}": Companions(
                "standard_analog_output_mask", number, "standard_analog_output_type"
            )
            for number in (0, 1)
        },
    }
)
"""Value field -> what it acts through. Every other input acts by itself, as registers and the masks themselves do."""


def _select_values() -> dict[str, int]:
    bits: dict[str, int] = {}
    for needs in COMPANIONS.values():
        if needs.bit is not None:
            bits[needs.mask] = bits.get(needs.mask, 0) | 1 << needs.bit
    return bits


MASK_BITS: Mapping[str, int] = MappingProxyType(_select_values())
"""Mask whose bits select whole values -> all of them; every other bit means nothing."""
