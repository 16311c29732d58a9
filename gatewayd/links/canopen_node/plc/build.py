"""From a compiled mapping to the model of the program of its node's master."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import PurePath
from typing import Final

from gatewayd.canopen.datatypes import CanType
from gatewayd.core.definition import CellDefinition, Direction
from gatewayd.links.canopen_node.plan import CanopenPlan, ObjectPlan, PdoPlan, canopen_of
from gatewayd.links.canopen_node.plc.model import PdoImage, PdoModel, PdoTag, PdoWord
from gatewayd.links.canopen_node.status_words import HEADER
from gatewayd.links.exports import ExportError
from gatewayd.links.registry import status_fields
from gatewayd.mapping.plan import Plan
from gatewayd.plc.model import Encoding
from gatewayd.plc.tags import PlcWishes, members, renamed, split_name, tag_keys, writer_of
from gatewayd.report.printable import printable
from gatewayd.report.wording import one_and_more

_TYPES: Final[Mapping[CanType, str]] = {
    CanType.INTEGER8: "int8",
    CanType.INTEGER16: "int16",
    CanType.INTEGER32: "int32",
    CanType.INTEGER64: "int64",
    CanType.UNSIGNED8: "uint8",
    CanType.UNSIGNED16: "uint16",
    CanType.UNSIGNED32: "uint32",
    CanType.UNSIGNED64: "uint64",
    CanType.REAL32: "float32",
    CanType.REAL64: "float64",
}
"""Type of CiA 301 -> key of `plc.numbers.NUMBERS`."""
_LAST_SYNCHRONOUS: Final = 240
"""Greatest transmission type that goes by SYNC (CiA 301, 7.5.2.36)."""


def model_of(plan: Plan, wishes: PlcWishes) -> PdoModel:
    """The model. Raises ExportError for a cell that is no CANopen node, and where no program could do what it says."""
    node = canopen_of(plan)
    if node is None:
        raise ExportError(
            f"{plan.source}: the cell is no CANopen node: "
            "add `canopen: {channel: can0, bitrate: 500000, node: 16}`"
        )
    if wishes.host is not None:
        raise ExportError(
            "--host is for Modbus: on CANopen the node-ID of the mapping says where the node is"
        )
    if wishes.handshake is not None:
        raise ExportError(
            "--handshake is for Modbus: nothing confirms that a PDO has arrived, so no self test can be led by it"
        )
    cell = plan.cell
    by_rpdo = {pdo: _writer(pdo, node) for pdo in node.pdos if pdo.direction is Direction.INPUT}
    writers = {writer for writer in by_rpdo.values() if writer is not None}
    writer = writer_of(cell, writers, wishes.writer, "CANopen, by RPDO")
    chosen = [
        pdo
        for pdo in node.pdos
        if pdo.direction is Direction.OUTPUT or (writer is not None and by_rpdo[pdo] == writer)
    ]
    mapped = {pdo: list(_tags(pdo, node, cell)) for pdo in chosen}
    called = iter(renamed([tag for its in mapped.values() for tag in its], wishes.names))
    images = tuple(_image(pdo, [next(called) for _tag in its], cell) for pdo, its in mapped.items())
    doubles = [line for image in images for line in _doubles(image)]
    if doubles:
        raise ExportError("\n".join(doubles))
    return PdoModel(
        cell=cell.name,
        source=printable(PurePath(plan.source).name),
        fingerprint=cell.fingerprint,
        prefix=wishes.prefix,
        writer="" if writer is None else cell.writers[writer].name,
        writer_number=0 if writer is None else writer + 1,
        writers=tuple(known.name for known in cell.writers),
        inputs=members(_once(images, transmits=False)),
        outputs=members(_once(images, transmits=True)),
        variables=tuple(variable.name for variable in cell.variables),
        left_out=tuple(_left_out(cell, images)),
        node=node.node,
        bitrate=node.bitrate,
        pdos=images,
    )


def _writer(pdo: PdoPlan, node: CanopenPlan) -> int | None:
    return node.rpdo_writer if pdo.writer is None else pdo.writer


def _once(images: Sequence[PdoImage], *, transmits: bool) -> list[PdoTag]:
    """Each variable once, where it lies first, in the order of the mapping."""
    found: dict[int, PdoTag] = {}
    for image in images:
        for tag in image.tags if image.transmits == transmits else ():
            found.setdefault(tag.number, tag)
    return [tag for _number, tag in sorted(found.items())]


def _name(pdo: PdoPlan) -> str:
    return f"{'tpdo' if pdo.direction is Direction.OUTPUT else 'rpdo'}{pdo.number}"


def _image(pdo: PdoPlan, tags: Sequence[PdoTag], cell: CellDefinition) -> PdoImage:
    bits = sum(entry.bits for entry in pdo.entries)
    return PdoImage(
        name=_name(pdo),
        transmits=pdo.direction is Direction.OUTPUT,
        cob_id=pdo.cob_id,
        size=(bits + 7) // 8,
        how="with SYNC" if pdo.transmission <= _LAST_SYNCHRONOUS else "event-driven",
        tags=tuple(tags),
        words=tuple(_words(pdo, cell)),
    )


def _tags(pdo: PdoPlan, node: CanopenPlan, cell: CellDefinition) -> Iterator[PdoTag]:
    objects = {(item.index, item.subindex): item for item in node.objects}
    start = 0
    for entry in pdo.entries:
        if entry.variable is not None:
            yield _tag(objects[entry.index, entry.subindex], _name(pdo), start, cell)
        start += entry.bits


def _tag(item: ObjectPlan, pdo: str, start: int, cell: CellDefinition) -> PdoTag:
    encoding = None
    if item.type is not CanType.BOOLEAN:
        encoding = Encoding(_TYPES[item.type], "", *(item.linear or (1.0, 0.0)))
    keys = tag_keys(cell.variables[item.variable], cell, encoding)
    return PdoTag(**keys, pdo=pdo, start=start, index=item.index, subindex=item.subindex)


def _words(pdo: PdoPlan, cell: CellDefinition) -> Iterator[PdoWord]:
    fields = status_fields()
    start = 0
    for entry in pdo.entries:
        if entry.quality_of is not None:
            variable = cell.variables[entry.quality_of]
            about = f"quality of {variable.name}"
            yield PdoWord(
                "quality", variable.number, about, _name(pdo), start, 1, entry.index, entry.subindex
            )
        elif entry.variable is None and entry.index == HEADER:
            name = fields[entry.subindex - 1].name
            words = entry.bits // 16
            yield PdoWord(
                name, 0, f"{name} of the status", _name(pdo), start, words, entry.index, entry.subindex
            )
        start += entry.bits


def _doubles(image: PdoImage) -> Iterator[str]:
    """Members of one name in the structure of a PDO: elements of families have names of their own there."""
    known = {word.object_name: ("", f"the {word.about}") for word in image.words}
    for tag in image.tags:
        path, other = known.setdefault(tag.object_name.lower(), (tag.path, f"`{tag.name}`"))
        # What differs in capitals only is refused for every tool, with all else that it does not take.
        if path.lower() != tag.path.lower():
            yield (
                f"{image.name}: `{tag.name}` and {other} would be the same member `{tag.object_name}`: "
                f"call one of them otherwise here: --name {split_name(tag.name)[0]}=NAME"
            )


def _left_out(cell: CellDefinition, images: Sequence[PdoImage]) -> Iterator[str]:
    """What this PLC does not write, and what is in no PDO."""
    mapped = {tag.number for image in images for tag in image.tags}
    absent = [variable for variable in cell.variables if variable.number not in mapped]
    inputs = [variable.name for variable in absent if variable.direction is Direction.INPUT]
    outputs = [variable.name for variable in absent if variable.direction is Direction.OUTPUT]
    if inputs:
        yield f"{one_and_more(inputs)}: in no RPDO of this PLC"
    if outputs:
        yield f"{one_and_more(outputs)}: in no TPDO"
