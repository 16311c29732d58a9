"""Which column of a register list means what, by the names that English and German lists use."""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

_FOLDED: Final = str.maketrans({"ä": "ae", "ö": "oe", "ü": "ue", "ß": "ss"})

MEANINGS: Final[Mapping[str, str]] = MappingProxyType(
    {
        "number": "number", "name": "name", "direction": "direction", "access": "access", "robot": "robot's field",
        "area": "area", "function": "function code", "address": "address", "bit": "bit", "notation": "4xxxxx address",
        "words": "length", "type": "type", "order": "byte order", "scale": "scale", "offset": "offset",
        "unit": "unit", "low": "least value", "high": "greatest value",
        "limits": "limits", "clamp": "clamping", "owner": "owner",
        "lease": "lease", "takeover": "takeover", "group": "group", "on_release": "value when the writer is lost",
        "on_stale": "value when the robot is lost", "comment": "comment", "whole": "whole takeover",
        "valid": "validity", "canopen": "CANopen object",
        "device": "place on a device",
    }
)  # fmt: skip
"""Column -> what it is called in a finding."""

_SPELLINGS: Final[Mapping[str, str]] = {
    "number": "number no nr lfdnr index pos position",
    "name": "name tag tagname variable variablename symbol signal signalname bezeichnung bezeichner variablenname "
    "parameter datapoint datenpunkt registername",
    "direction": "direction dir richtung",
    "access": "access rw readwrite accessmode zugriff zugriffsart schreibenlesen lesenschreiben",
    "robot": "robot roboter rtde rtdefield robotfield",
    "area": "area table registertype objecttype objekttyp bereich registerart modbustype modbusarea",
    "function": "function functioncode fc funktion funktionscode modbusfunction",
    "address": "address addr register reg registeraddress modbusaddress adresse registeradresse modbusadresse "
    "registernummer registernumber startaddress startadresse modbusregister addressdec adressedez addresshex "
    "adressehex",
    "bit": "bit bitnr bitnumber bitno bitnummer bitposition",
    "notation": "notation modicon modiconaddress modiconadresse",
    "words": "words length size registers count numberofregisters laenge anzahl anzahlregister worte anzahlworte",
    "type": "type datatype dataformat format typ datentyp datenformat",
    "order": "order byteorder wordorder endianness endian bytereihenfolge wortreihenfolge",
    "scale": "scale factor scaling scalefactor scalingfactor multiplier gain resolution skalierung faktor "
    "skalierungsfaktor aufloesung",
    "offset": "offset versatz nullpunkt",
    "unit": "unit units einheit dimension engineeringunit",
    "low": "low min minimum lowerlimit minwert untergrenze minvalue",
    "high": "high max maximum upperlimit maxwert obergrenze maxvalue",
    "limits": "limits limit range valuerange minmax lowhigh wertebereich grenzen grenzwerte messbereich minundmax",
    "clamp": "clamp",
    "owner": "owner writer schreiber",
    "lease": "lease",
    "takeover": "takeover",
    "group": "group gruppe",
    "on_release": "onrelease",
    "on_stale": "onstale",
    "comment": "comment comments description remark remarks note notes kommentar beschreibung bemerkung bedeutung "
    "meaning",
    "whole": "whole",
    "valid": "valid",
    "canopen": "object",
    "device": "deviceplace",
}
"""Column -> spellings of its name, folded."""

DETAIL: Final = "detail"
"""Columns that say more of what another one says: they are passed over."""
_KNOWN: Final = {spelling: column for column, names in _SPELLINGS.items() for spelling in names.split()}
_OF_OTHERS: Final = frozenset(
    {"cantype", "pdo", "cobid", "pdobit"}
    | {"device", "devicetype", "devicescale", "deviceoffset", "devicepoll", "devicepdo"}
    | {"mqttname", "mqttinterval", "mqttdeadband"}
)
"""Columns of `gatewayd show` that say more of the CANopen object, of the place on a device, and of MQTT."""


def column_of(head: str) -> str:
    """The meaning of a column by its name, whatever its case, blanks and units in brackets; empty: not recognised."""
    folded = re.sub(r"[(\[].*?[)\]]", "", head.lower().translate(_FOLDED))
    folded = re.sub(r"[^a-z0-9]", "", folded)
    return DETAIL if folded in _OF_OTHERS else _KNOWN.get(folded, "")
