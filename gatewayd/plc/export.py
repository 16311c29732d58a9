"""`gatewayd export plc`: what the command says and asks, the same for every link by which a PLC reaches the gateway."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Final, cast

from gatewayd.links.exports import ExportedFile, ExportError, ExportOption, ExportSet, ExportWay
from gatewayd.mapping.plan import Plan
from gatewayd.plc.tags import NOBODY, PlcWishes

TARGETS: Final[Mapping[str, str]] = {
    "iec-st": "structured text of edition 2, for every tool",
    "codesys": "CODESYS 3: PLCopen XML, and a table of the channels",
    "twincat": "TwinCAT 3: a file for each object, client TF6250",
    "tia": "TIA Portal: external sources in SCL, client MB_CLIENT",
    "studio5000": "Studio 5000: data types and routines as L5X, tags as CSV",
    "c": "a C99 header, for soft PLCs and test benches",
}
"""Name -> what it is for. Each link has a module for it, with `_`, or a reason why it has none."""
_TARGET_LIST: Final = "\n".join(f"  {name:<12} {meaning}" for name, meaning in TARGETS.items())


def plc_export(
    link: str,
    has: Callable[[Plan], bool],
    files: Callable[[Plan, PlcWishes, str, bool], Iterable[ExportedFile]],
) -> ExportSet:
    """The command for one kind of link.

    `files` makes those of a plan, from wishes, for a target of `TARGETS`; the last says that the controller has no
    64-bit numbers.
    """

    def make(plan: Plan, **options: object) -> Sequence[ExportedFile]:
        wishes = PlcWishes(
            writer=cast("str | None", options["writer"]),
            prefix=cast("str", options["prefix"]),
            names=dict(map(_pair, cast("Sequence[str]", options["name"]))),
            host=cast("str | None", options["host"]),
            handshake=cast("str | None", options["handshake"]),
        )
        return tuple(files(plan, wishes, cast("str", options["for"]), bool(options["small"])))

    return ExportSet("plc", _SUMMARY, _HELP, _EXAMPLES, _OPTIONS, (ExportWay(link, has, make),))


def _pair(text: str) -> tuple[str, str]:
    old, equals, new = text.partition("=")
    if not (equals and old and new):
        raise ExportError(f"--name {text}: write --name OLD=NEW, with the name of the mapping first")
    return old, new


_SUMMARY: Final = "Data types and code for the engineering tool of a PLC."
_HELP: Final = f"""\
Write a program of a PLC for a mapping FILE, in the form that its engineering tool imports: data types
with units, places and comments, code that packs and unpacks registers or PDOs, the status block decoded and watched,
and for Modbus the poll plan.

\b
{_TARGET_LIST}

Generated files are made anew; where somebody changed one, it is named and nothing is written. The one with Main in its
name is yours: it is only written where there is none.

What a tool cannot hold (a keyword, a long name, a 64-bit number in a small controller) is refused with a remedy;
nothing is renamed in silence.
"""
_EXAMPLES: Final = (
    "gatewayd export plc my-cell.yaml --for iec-st -o plc/",
    "gatewayd export plc my-cell.yaml --for iec-st --writer hmi --prefix HMI -o hmi/",
    "gatewayd export plc my-cell.yaml --for iec-st --name start=start_cycle -o plc/",
    "gatewayd export plc my-cell.yaml --for iec-st --handshake start:busy -o plc/",
    "gatewayd export plc line.yaml --for c --link canopen -o master/",
)
_OPTIONS: Final = (
    ExportOption("--for", "Which tool.", "TARGET", choices=tuple(TARGETS), required=True),
    ExportOption(
        "--writer",
        f"Which writer of the mapping the PLC is; `{NOBODY}`: it only reads. Needed where there are several.",
        "NAME",
    ),
    ExportOption("--prefix", "What all generated names begin with.", "NAME", default="GW"),
    ExportOption(
        "--name",
        "Call a variable, or a family of them, otherwise in the PLC; may be given several times.",
        "OLD=NEW",
        multiple=True,
    ),
    ExportOption(
        "--host", "How the PLC reaches the gateway by Modbus, if not where the mapping listens.", "ADDRESS"
    ),
    ExportOption(
        "--handshake",
        "Adds a self test, led by these two bits as that of `gatewayd export urscript`; structured text on Modbus.",
        "TOGGLE:ACKNOWLEDGE",
    ),
    ExportOption("--small", "For a controller without 64-bit numbers: refuse what needs them."),
)
