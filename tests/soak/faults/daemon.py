"""Faults of the daemon's own house: its process, its mapping file, its audit file."""

from __future__ import annotations

import signal
import threading
import time
from pathlib import Path
from random import Random

from gatewayd.audit.file import KEPT, MAX_SIZE
from gatewayd.audit.merging import EACH_PERIOD
from tests.e2e.plc import STRANGER, Plc
from tests.e2e.processes import HOST, wait_for
from tests.soak.cell import MOMENT, STALE_AFTER, VARIANTS
from tests.soak.faults.common import suspend
from tests.soak.rig import PATIENCE, Rig
from tests.soak.truth import Stop

_STILL = (0.2, 1.0), (1.0, 9.5)
"""Seconds; short and long gaps come equally often. A client of the rig waits 10 s for an answer."""
_TOLERANCE = 0.3
_ACCUSATIONS = "writer lost", "robot lost"
_FACT = "by the controller"
"""In a reason: the controller closed the connection of a client that read nothing for seconds, as it may."""
_TROUBLE, _END = "cannot write the audit file", "the audit file can be written again"
_UNWRITABLE = ("/dev/full", ".", "/nowhere/audit.jsonl")
"""A full disk, a directory, a directory that is gone."""


def stand_still(rig: Rig, chance: Random) -> None:
    """Time is judged before what waited: nothing old is served as good, and nobody living is accused."""
    before = _accusations(rig)
    reader = Plc(rig.modbus, STRANGER, host=HOST)
    served: list[float] = []
    asking = threading.Thread(target=lambda: served.extend(reader.doubles(MOMENT)), daemon=True)

    def meanwhile() -> None:
        asking.start()
        time.sleep(chance.uniform(*chance.choice(_STILL)))

    begin = time.monotonic()
    suspend(rig.daemon, meanwhile)
    rig.record.stops.append(Stop(begin, time.monotonic()))
    continued = rig.witness.timestamp(time.monotonic())
    asking.join(PATIENCE)
    reader.close()
    assert served, "no answer to a read that waited"
    old = continued - served[0]
    assert served[0] == -1 or old < STALE_AFTER + _TOLERANCE, f"a value {old:.1f} s old was served as good"
    wait_for(lambda: not rig.look.ills(), "all to be well", PATIENCE)
    accused = _accusations(rig)
    assert len(accused) == len(before), accused[-1]


def _accusations(rig: Rig) -> list[str]:
    found = (line for words in _ACCUSATIONS for line in rig.daemon.lines(words))
    return sorted(line for line in found if _FACT not in line)


def reload(rig: Rig, chance: Random) -> None:
    """Until the other mapping is there; a recipe that changed makes the robot start anew."""
    present = rig.look.values()
    now = "another place" if "extra" in present else "another field" if "fresh" in present else "plain"
    wanted = chance.choice([name for name in VARIANTS if name != now])
    rig.write_mapping(wanted)
    rig.daemon.signal(signal.SIGHUP)

    def changed() -> bool:
        names = rig.look.values()
        return bool(names) and (("extra" in names), ("fresh" in names)) == (
            wanted == "another place",
            wanted == "another field",
        )

    wait_for(changed, f"the mapping with {wanted}", PATIENCE)


def broken_reload(rig: Rig, _chance: Random) -> None:
    good = rig.mapping.read_text("utf-8")
    rig.mapping.write_text(good + "variables: again\n", "utf-8")
    rig.daemon.signal(signal.SIGHUP)
    wait_for(lambda: any("reload" in ill for ill in rig.look.ills()), "the reload to be refused", PATIENCE)
    rig.mapping.write_text(good, "utf-8")
    rig.daemon.signal(signal.SIGHUP)


def unwritable_audit(rig: Rig, chance: Random) -> None:
    """Over when the daemon writes to the former file again, without a record lost."""
    aside, link = rig.audit.with_suffix(".aside"), rig.audit.with_suffix(".link")
    troubles, ends = (len(rig.daemon.lines(line)) for line in (_TROUBLE, _END))
    aside.hardlink_to(rig.audit)
    link.symlink_to(chance.choice(_UNWRITABLE))
    # Never a moment without the name: the daemon would begin a file of its own there.
    link.replace(rig.audit)
    wait_for(lambda: len(rig.daemon.lines(_TROUBLE)) > troubles, "the audit's trouble", PATIENCE)
    time.sleep(chance.uniform(0, 2))
    aside.replace(rig.audit)
    wait_for(lambda: len(rig.daemon.lines(_END)) > ends, "the audit to go on", PATIENCE)
    last = rig.daemon.lines(_END)[-1]
    assert "dropped=0" in last, last


def full_audit(rig: Rig, _chance: Random) -> None:
    """A file of the size at which it is rotated, put in the audit's place; over when a new one is begun.

    That is with the next record, and of equal ones there is one in `EACH_PERIOD` seconds.
    """
    full = rig.audit.with_suffix(".full")
    with full.open("wb") as stream:
        stream.truncate(MAX_SIZE)
    number = full.stat().st_ino
    full.replace(rig.audit)
    former = rig.audit.with_name(rig.audit.name + ".1")
    wait_for(lambda: _inode(former) == number, "the rotation", EACH_PERIOD + PATIENCE)
    wait_for(rig.audit.exists, "the new file", PATIENCE)
    kept = list(rig.audit.parent.glob(rig.audit.name + ".*"))
    assert len(kept) <= KEPT, f"{len(kept)} former audit files"


def _inode(path: Path) -> int | None:
    try:
        return path.stat().st_ino
    except FileNotFoundError:  # it is being rotated at this moment
        return None
