"""Bits to reals by a pointer: the form of CODESYS and of what stems from it, and one that PLCopen XML can carry.

A union does the same, but the exchange format has none.
"""

from __future__ import annotations

from typing import Final

from gatewayd.plc.st.convert import function
from gatewayd.plc.st.dialect import Primitives
from gatewayd.plc.st.program import PlcVariable, ProgramUnit, TypeName

_PAIRS: Final = (("REAL", "DWORD"), ("LREAL", "LWORD"))


def _units(prefix: str) -> tuple[ProgramUnit, ...]:
    found = []
    for real, bits in _PAIRS:
        for verb, result, operand, kind in (("To", real, "bits", bits), ("From", bits, "value", real)):
            name = f"{prefix}_{verb}{real.capitalize()}"
            seen = PlcVariable("seen", TypeName(result, is_pointer=True))
            body = (f"seen := ADR({operand});", f"{name} := seen^;")
            comment = f"the same bits as {result}"
            found.append(function(name, result, ((operand, kind),), body, local=(seen,), comment=comment))
    return tuple(found)


POINTER: Final = Primitives(_units)
"""NaN and infinities come through as they are."""
