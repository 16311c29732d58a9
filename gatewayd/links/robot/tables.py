"""What the robot's kind shows of a mapping."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from gatewayd.core.definition import Direction
from gatewayd.links.robot.dashboard.variables import meanings_of, name_of
from gatewayd.links.robot.declaration import KIND
from gatewayd.links.tables import LinkTables
from gatewayd.mapping.expanded import ExpandedCell
from gatewayd.report.layout import Column, Row
from gatewayd.report.wording import family
from gatewayd.rtde.enums import BITS, MEANINGS


class RobotTables(LinkTables):
    """One column: what a variable is in the robot."""

    key = KIND.key
    columns = (Column("robot", before="unit"),)
    screen = (Column("robot", before="value", coloured=True),)
    page = (Column("robot", before="value"),)

    def rows(self, cell: ExpandedCell) -> Mapping[int, Sequence[Mapping[str, object]]]:
        """`input_bit_register_5`, `actual_TCP_pose[0]`."""
        return {variable.index: [{"robot": variable.target}] for variable in cell.variables}

    def on_screen(self, first: Row, last: Row) -> Mapping[str, str]:
        """With the way that the value goes."""
        arrow = "->" if first.direction == Direction.INPUT.value else "<-"
        return {"robot": f"{arrow} {family(first['robot'], last['robot'])}"}

    def legend(self, cell: ExpandedCell) -> Iterator[str]:
        """`runtime_state: 0 stopping, 1 stopped, ...`; of bits the mapped ones, `bit 2 protective stopped`."""
        used: dict[str, set[int | None]] = {}
        for variable in cell.variables:
            used.setdefault(variable.field, set()).add(variable.bit)
        for variable in cell.variables:
            if variable.via and (numbers := meanings_of(name_of(variable.field))):
                yield f"{variable.field}: {', '.join(f'{number} {words}' for number, words in numbers.items())}"
        for field, bits in used.items():
            words = [f"{number} {words}" for number, words in MEANINGS.get(field, {}).items()]
            words += [
                f"bit {bit} {words.on}"
                for bit, words in BITS.get(field, {}).items()
                if bit in bits or None in bits
            ]
            if words:
                yield f"{field}: {', '.join(words)}"


TABLES: Final = RobotTables()
