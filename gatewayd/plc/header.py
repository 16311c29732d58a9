"""What stands at the head of every generated file: what it is of, how to make it anew, what is not in it."""

from __future__ import annotations

from gatewayd.links.exports import CHECKSUM
from gatewayd.plc.model import CellModel


def header(model: CellModel, subject: str) -> tuple[str, ...]:
    """Lines for a file that is made anew with each export."""
    return (
        f"cell {model.cell}: {subject}",
        f"Made by gatewayd export plc from {model.source}, fingerprint {model.fingerprint:08x}.",
        "Change the mapping and make this file anew, instead of changing it.",
        CHECKSUM,
    )


def beginning(model: CellModel) -> str:
    """For the file that is the user's own."""
    return f"cell {model.cell}: a program to begin with. It is yours: the other files are made anew, this one is not."


def overview(model: CellModel) -> tuple[str, ...]:
    """Who the PLC is, and what of the mapping is not there."""
    role = (
        f"The PLC is the writer {model.writer}, number {model.writer_number}."
        if model.writer
        else "The PLC only reads."
    )
    return (role, *(f"Left out: {text}." for text in model.left_out))
