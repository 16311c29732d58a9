"""Structured text of IEC 61131-3 edition 2, for masters that hand over the bytes of each PDO."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from gatewayd.links.canopen_node.plc.blocks import blocks, data_types, main
from gatewayd.links.canopen_node.plc.content import Bytes
from gatewayd.links.canopen_node.plc.model import PdoModel
from gatewayd.links.canopen_node.plc.pdo_text import pdo_lines
from gatewayd.links.exports import ExportedFile
from gatewayd.plc.header import beginning, header, overview
from gatewayd.plc.keywords import IEC
from gatewayd.plc.names import Holds
from gatewayd.plc.st.convert import PORTABLE, functions
from gatewayd.plc.st.dialect import Dialect
from gatewayd.plc.st.source import data_type_source, text_of, unit_source

HOLDS: Final = Holds(
    "edition 2", 32, IEC, frozenset({"LINT", "ULINT", "LREAL"}), "controllers without 64-bit numbers"
)
DIALECT: Final = Dialect(PORTABLE)
CONTENT: Final = Bytes()


def files(model: PdoModel) -> Iterator[ExportedFile]:
    """Data types, functions, blocks, and a program to begin with."""
    prefix = model.prefix
    about = (*header(model, "data types"), *overview(model), *pdo_lines(model))
    types = map(data_type_source, data_types(model, DIALECT, CONTENT))
    yield ExportedFile(f"{prefix}_Types.st", text_of(about, types))
    conversions = functions(model, DIALECT, of_bytes=True)
    yield ExportedFile(
        f"{prefix}_Convert.st", text_of(header(model, "conversions"), map(unit_source, conversions))
    )
    units = blocks(model, DIALECT, CONTENT)
    yield ExportedFile(f"{prefix}_Blocks.st", text_of(header(model, "blocks"), map(unit_source, units)))
    notes = (
        "(* Copy the bytes of the TPDOs from your master into from_node here. *)" if model.from_node else "",
        "(* Copy the bytes of to_node into the RPDOs of your master here. *)" if model.to_node else "",
    )
    program = unit_source(main(model, notes=notes))
    yield ExportedFile(f"{prefix}_Main.st", text_of((beginning(model),), [program]), once=True)
