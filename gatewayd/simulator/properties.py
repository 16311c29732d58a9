"""What the simulated controller says of itself by READ_PROPERTIES (message 82, in no guide)."""

from __future__ import annotations

from collections.abc import Mapping

from gatewayd.rtde.fields import Series, SoftwareVersion
from gatewayd.rtde.messages import NOT_FOUND, PropertiesReply
from gatewayd.rtde.properties import KNOWN_PROPERTIES
from gatewayd.rtde.recipe import Recipe

PROPERTIES_SINCE: Mapping[Series, SoftwareVersion] = {
    Series.E: SoftwareVersion(5, 26),
    Series.X: SoftwareVersion(10, 15),
}
"""First software that answers, as UR's client libraries have it."""
_BOX_TYPE, _BOX_SUBTYPE = 5, 1
_FLANGE_TYPE, _FLANGE_REVISION = 1, 0


def answer_properties(names: tuple[str, ...], version: SoftwareVersion) -> PropertiesReply:
    """Types and values; no values where one name is not found."""
    known = [KNOWN_PROPERTIES.get(name) for name in names]
    words = tuple(NOT_FOUND if found is None else found.type.word for found in known)
    types = [found.type for found in known if found is not None]
    if len(types) < len(names):
        return PropertiesReply(words, b"")
    values = _values(version)
    return PropertiesReply(words, Recipe(names, types).pack([values[name] for name in names]))


def _values(version: SoftwareVersion) -> dict[str, int]:
    return {
        "v1.software.version": version.major << 48 | version.minor << 32 | version.bugfix << 16,
        "v1.control_box.type": _BOX_TYPE << 24 | _BOX_SUBTYPE << 16,
        "v1.robot_arm.tool_flange.type": _FLANGE_TYPE << 24 | _FLANGE_REVISION << 16,
    }
