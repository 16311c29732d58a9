"""The timeline of docs/explanation/ownership.md, played on the real core."""

from __future__ import annotations

import re

from gatewayd.core.admission import Change
from gatewayd.core.cell import Cell
from gatewayd.core.refusal import Reason
from gatewayd.core.requester import Requester
from gatewayd.mapping.loader import load
from tests.docs.generated import DOCS

PAGE = (DOCS / "explanation" / "ownership.md").read_text()
PLC, HMI = 0, 1
ACTS = [(0, HMI, 30), (1, HMI, 30), (2, PLC, 50), (3, PLC, 50), (3.5, HMI, 40), (7, HMI, 10)]


def cell() -> Cell:
    """A cell with the page's own variable, connected and adopted."""
    line = re.search(r"^`(speed: \{.*\})`$", PAGE, re.MULTILINE)
    assert line
    variable = line[1].replace("{owner", "{robot: input_double_register_0, modbus: 0, owner")
    text = (
        "gatewayd: 1\ncell: timeline\nrobot: {host: 127.0.0.1}\nmodbus: {}\n"
        f"writers:\n  plc: {{modbus: 127.0.0.2}}\n  hmi: {{modbus: 127.0.0.3}}\nvariables:\n  {variable}\n"
    )
    plan = load(text.encode(), "timeline.yaml").plan
    assert plan is not None
    made = Cell(plan.cell)
    made.robot_connected(-1.0)
    made.adopt({0: 0.0}, -1.0)
    return made


def test_timeline_is_what_happens() -> None:
    played = cell()
    seen: dict[float, tuple[int | None, object]] = {}
    acts = {round(time * 10): (writer, value) for time, writer, value in ACTS}
    for tenth in range(81):
        now = tenth / 10
        played.tick(now)
        if tenth in acts:
            writer, value = acts[tenth]
            refusal = played.write(Requester(writer), [Change(0, float(value))], now)
            assert (refusal is not None and refusal.reason is Reason.HELD) is (now == 3.5)
        seen[now] = played.ownership.owners[0], played.image.values[0]
    assert [seen[now] for now in (0.0, 1.9, 2.0, 3.5, 4.9, 5.0, 6.9, 7.0)] == [
        (HMI, 30.0),
        (HMI, 30.0),
        (PLC, 50.0),
        (PLC, 50.0),
        (PLC, 50.0),
        (None, 0.0),
        (None, 0.0),
        (HMI, 10.0),
    ]


def test_picture_shows_these_acts() -> None:
    """One second is ten characters; every `W value` stands at its time."""
    block = re.search(r"^seconds.*?```", PAGE, re.MULTILINE | re.DOTALL)
    assert block
    rows = {line.split()[0]: line for line in block[0].splitlines() if line[:1].strip()}
    start = rows["seconds"].index("0")
    for time, writer, value in ACTS:
        place = start + round(time * 10)
        assert rows["plc" if writer == PLC else "hmi"][place:].startswith(f"W {value}")
