"""The families of devices that there are: what differs between them lies in a package each, imported when it is used.

A package has `language` (`FAMILY`, a `FamilyLanguage`), `description` (`FAMILY`, a `FamilyDescription`), `link`
(`FAMILY`, a `FamilyRuntime`), `doctor` (`EXAMINATION`) and `access` (`ACCESS`, a `DeviceAccess`). Its sections are
bases of those in `sections`.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Final, cast

if TYPE_CHECKING:
    # The daemon has no use for the language, and a check none for links.
    from gatewayd.links.access import DeviceAccess
    from gatewayd.links.devices.family import FamilyDescription, FamilyLanguage, FamilyRuntime
    from gatewayd.links.examination import Examination

FAMILIES: Final = {
    "modbus": "gatewayd.links.devices.modbus",
    "canopen": "gatewayd.links.devices.canopen",
}
"""Package by the family's name, which its plans have (`DevicePlan.family`)."""


@cache
def language_of_family(family: str) -> FamilyLanguage:
    """What a family adds to the mapping language."""
    return cast("FamilyLanguage", import_module(f"{FAMILIES[family]}.language").FAMILY)


@cache
def description_of_family(family: str) -> FamilyDescription:
    """What puts plans of a family into words."""
    return cast("FamilyDescription", import_module(f"{FAMILIES[family]}.description").FAMILY)


@cache
def examination_of_family(family: str) -> Examination:
    """What looks at what devices of a family need."""
    return cast("Examination", import_module(f"{FAMILIES[family]}.doctor").EXAMINATION)


@cache
def access_of_family(family: str) -> DeviceAccess:
    """What talks to devices of a family where no gateway does."""
    return cast("DeviceAccess", import_module(f"{FAMILIES[family]}.access").ACCESS)


@cache
def runtime_of_family(family: str) -> FamilyRuntime:
    """What makes links of a family."""
    return cast("FamilyRuntime", import_module(f"{FAMILIES[family]}.link").FAMILY)
