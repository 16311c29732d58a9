"""Register lists for these tests, and what becomes of them."""

from __future__ import annotations

from gatewayd.cli.importing.register_list.mapping import ListSettings
from gatewayd.cli.importing.register_list.proposal import Proposal, proposal

SETTINGS = ListSettings(
    cell="press", host="127.0.0.9", listen="127.0.0.1:502", writers={"plc": "127.0.0.1"}, series="e"
)
ENGLISH = """\
Register list of the press,,,,,
,,,,,
Tag name,Modbus address,Data type,R/W,Scale factor,Unit,Description
start,400001.0,BOOL,RW,,,begin one cycle
part,400011,UINT,RW,,,"1, 2 or 3"
force,400021,INT16,W,0.1,N,
cycles,400101,DINT,R,,,
ready,100001,BOOL,R,,,
"""
GERMAN = """\
Nr.;Bezeichnung;Adresse;Datentyp;Zugriff;Faktor;Einheit;Min;Max;Bemerkung
1;Zyklus starten;0.0;BOOL;Schreiben;;;;;beginnt einen Zyklus
2;Greifkraft;0x14;INT16;Schreiben;0,1;N;0;150;
3;Zähler;100;DINT;Lesen;;Stück;;;
"""


def made(text: str | bytes, counting: str = "", **settings: object) -> Proposal:
    content = text.encode() if isinstance(text, str) else text
    used = ListSettings(**{**{name: getattr(SETTINGS, name) for name in SETTINGS.__slots__}, **settings})
    return proposal(content, used, counting, "list.csv")


def errors(found: Proposal) -> list[tuple[int, int, str]]:
    return [(each.line, each.column, each.text) for each in found.findings if each.is_error]


def doubts(found: Proposal) -> list[tuple[int, int, str]]:
    return [(each.line, each.column, each.text) for each in found.findings if not each.is_error]


def lines(found: Proposal) -> dict[str, str]:
    """The variables of the mapping: name -> what stands behind it."""
    assert found.text is not None, found.findings
    body = found.text.partition("variables:\n")[2]
    return {
        name.strip(): rest.strip() for name, _, rest in (line.partition(":") for line in body.splitlines())
    }
