"""The files for the engineering tool of a PLC."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, cast

from gatewayd.links.exports import ExportedFile, ExportError, ExportOption, ExportSet
from gatewayd.links.modbus_server.plc.build import NOBODY, PlcWishes, model_of
from gatewayd.links.modbus_server.plc.registry import TARGETS, files_for
from gatewayd.mapping.plan import Plan


def _made(plan: Plan, **options: object) -> Sequence[ExportedFile]:
    wishes = PlcWishes(
        writer=cast("str | None", options["writer"]),
        prefix=cast("str", options["prefix"]),
        names=dict(map(_pair, cast("Sequence[str]", options["name"]))),
        host=cast("str | None", options["host"]),
    )
    return files_for(cast("str", options["for"]), model_of(plan, wishes), small=bool(options["small"]))


def _pair(text: str) -> tuple[str, str]:
    old, equals, new = text.partition("=")
    if not (equals and old and new):
        raise ExportError(f"--name {text}: write --name OLD=NEW, with the name of the mapping first")
    return old, new


_TARGET_LIST: Final = "\n".join(f"  {name:<12} {meaning}" for name, meaning in TARGETS.items())

EXPORTS: Final = (
    ExportSet(
        "plc",
        "Data types and code for the engineering tool of a PLC.",
        f"""Write a program of a PLC for a mapping FILE, in the form that its engineering tool imports: data types with
units, addresses and comments, code that packs and unpacks the registers, the status block decoded and watched, and the
poll plan.

\b
{_TARGET_LIST}

Generated files are made anew; where somebody changed one, it is named and nothing is written. The one with Main in its
name is yours: it is only written where there is none.

What a tool cannot hold (a keyword, a long name, a 64-bit number in a small controller) is refused with a remedy;
nothing is renamed in silence.
        """,
        (
            "gatewayd export plc my-cell.yaml --for iec-st -o plc/",
            "gatewayd export plc my-cell.yaml --for iec-st --writer hmi --prefix HMI -o hmi/",
            "gatewayd export plc my-cell.yaml --for iec-st --name start=start_cycle -o plc/",
        ),
        (
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
                "--host", "How the PLC reaches the gateway, if not where the mapping listens.", "ADDRESS"
            ),
            ExportOption("--small", "For a controller without 64-bit numbers: refuse what needs them."),
        ),
        _made,
    ),
)
