"""The cases of the conformance test tool as its published trace numbers and names them, and how gatewayd ends them.

The trace is `test/test_report_CCT.md` of the repository CANopenNode/CANopenDemo. Numbers, names and results are the
trace's own; what a case asks is said here in our words.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Result(Enum):
    """How a case ends."""

    PASSED = "passed"
    WARNED = "passed with warnings"
    SKIPPED = "skipped"
    FAILED = "failed"


P, W, S, F = Result


@dataclass(frozen=True)
class Case:
    """One case: its number, its name, what it asks, how it ended in the trace, how it ends for gatewayd, and why."""

    number: str
    name: str
    asks: str
    trace: Result
    ours: Result = P
    why: str = ""

    @property
    def slug(self) -> str:
        """Its name in the names of tests."""
        return self.name.lower().replace(" ", "_")


_NO_RTR = "no remote frames for PDOs"

CASES = (
    Case(
        "1.0",
        "EDS checker",
        "the EDS has no errors",
        P,
        S,
        "the checker is Vector's; python-canopen reads the file",
    ),
    Case("2.1", "SDO 01", "read 1000h, expedited", P),
    Case("2.2", "SDO 02", "read and write any writable object of 1000h to 1FFFh", P),
    Case("2.3", "SDO 03", "a write to 1000h is refused", P),
    Case("2.4", "SDO 04", "a read of a write-only object is refused", S, S, "no object is write-only"),
    Case("2.5", "SDO 05", "sub-index 1000h:01 does not exist", P),
    Case("2.6", "SDO 06", "object 1004h does not exist", P),
    Case("2.7", "SDO 07", "a wrong command specifier is refused", P),
    Case("2.8", "SDO 08", "four bytes into an object of one or two are refused", P),
    Case("2.9", "SDO 09", "one byte into an object of two or four is refused", P),
    Case("2.10", "SDO 10", "a value that is too high is refused", P),
    Case("2.11", "SDO 11", "a value that is too low is refused", S),
    Case("2.12", "SDO 12", "1200h:01 and :02 hold the predefined COB-IDs", P),
    Case("2.13", "SDO 13", "read 1000h, segmented", P),
    Case("2.14", "SDO 14", "write 100Ch, segmented, if there is guarding", S),
    Case("2.15", "SDO 15", "write 1017h, segmented, if there is a heartbeat", P),
    Case("2.16", "SDO 16", "read an object of more than four bytes, segmented", P),
    Case("2.17", "SDO 17", "a wrong toggle bit ends a segmented read", P),
    Case("2.18", "SDO 18", "read such objects, segmented", P),
    Case("2.19", "SDO 19", "read 1000h by block transfer without CRC", P),
    Case("2.20", "SDO 20", "write 100Ch by block transfer without CRC, if there is guarding", S),
    Case("2.21", "SDO 21", "write 1017h by block transfer without CRC, if there is a heartbeat", P),
    Case("2.22", "SDO 22", "read an object of more than four bytes by block transfer", P),
    Case("2.23", "SDO 23", "the same with CRC", P),
    Case("2.24", "SDO 24", "write 100Ch by block transfer with CRC, if there is guarding", S),
    Case("2.25", "SDO 25", "write 1017h by block transfer with CRC, if there is a heartbeat", P),
    Case("2.26", "SDO 26", "a block size of 128 is refused", P),
    Case("2.27", "SDO 27", "a sequence number of 128 ends a block read", S),
    Case("2.28", "SDO 28", "read 1201h and the objects after it", P),
    Case("2.29", "SDO 29", "the same after a reset of communication", S, S, "one SDO server"),
    Case(
        "2.30", "SDO 30", "read 1280h and the objects after it, saved, after a reset", S, S, "no SDO client"
    ),
    Case("3.1", "PDO 01", "find the RPDOs by their communication parameters", P),
    Case("3.2", "PDO 02", "find the TPDOs by their communication parameters", P),
    Case("3.3", "PDO 03", "OPERATIONAL: a remote frame reads a TPDO", S, S, _NO_RTR),
    Case("3.4", "PDO 04", "OPERATIONAL: event-driven TPDO", P),
    Case("3.5", "PDO 05", "OPERATIONAL: TPDO by its event timer", P),
    Case("3.6", "PDO 06", "OPERATIONAL: TPDO by SYNC, cyclic", P),
    Case("3.7", "PDO 07", "OPERATIONAL: TPDO by SYNC, acyclic", F, F),
    Case("3.8", "PDO 08", "OPERATIONAL: TPDO by SYNC, cyclic, from a SYNC start value on", S),
    Case("3.9", "PDO 09", "STOPPED: a remote frame reads no TPDO", S, S, _NO_RTR),
    Case("3.10", "PDO 10", "STOPPED: no event-driven TPDO", P),
    Case("3.11", "PDO 11", "STOPPED: no TPDO by its event timer", P),
    Case("3.12", "PDO 12", "STOPPED: no TPDO by SYNC, cyclic", P),
    Case("3.13", "PDO 13", "STOPPED: no TPDO by SYNC, acyclic", P),
    Case("3.14", "PDO 14", "STOPPED: no TPDO from a SYNC start value on", S),
    Case("3.15", "PDO 15", "PRE-OPERATIONAL: a remote frame reads no TPDO", S, S, _NO_RTR),
    Case("3.16", "PDO 16", "PRE-OPERATIONAL: no event-driven TPDO", P),
    Case("3.17", "PDO 17", "PRE-OPERATIONAL: no TPDO by its event timer", P),
    Case("3.18", "PDO 18", "PRE-OPERATIONAL: no TPDO by SYNC, cyclic", P),
    Case("3.19", "PDO 19", "PRE-OPERATIONAL: no TPDO by SYNC, acyclic", P),
    Case("3.20", "PDO 20", "PRE-OPERATIONAL: no TPDO from a SYNC start value on", S),
    Case("3.21", "PDO 21", "what is mapped by default exists", P),
    Case("3.22", "PDO 22", "map correctly, in the order of CiA 301", F, F),
    Case("3.23", "PDO 23", "mapping without setting the number of objects to 0 is refused", P),
    Case("3.24", "PDO 24", "mapping of a valid PDO is refused", S),
    Case("3.25", "PDO 25", "too many objects are refused", P),
    Case("3.26", "PDO 26", "objects that are too long together are refused", P),
    Case("3.27", "PDO 27", "RPDO: an object to be written can be mapped", S),
    Case("3.28", "PDO 28", "RPDO: an object to be read cannot", P),
    Case("3.29", "PDO 29", "RPDO: an object that is not mappable cannot", P),
    Case("3.30", "PDO 30", "TPDO: an object to be read can be mapped", P),
    Case("3.31", "PDO 31", "TPDO: an object to be written cannot", S),
    Case("3.32", "PDO 32", "TPDO: an object that is not mappable cannot", P),
    Case("3.33", "PDO 33", "RPDO: a dummy object can be mapped", P),
    Case("4.1", "OD 01", "access every entry as its access type says", P),
    Case("4.2", "OD 02", "every entry has the default value of the EDS, if there is one", F),
    Case("4.3", "OD 03", "a write to a read-only entry is refused", P),
    Case("4.4", "OD 04", "a read of a write-only entry is refused", S, S, "no object is write-only"),
    Case(
        "4.5",
        "OD 05",
        "sub-index FFh, if there is one, says the type of its object",
        S,
        S,
        "no object has one",
    ),
    Case("4.6", "OD 06", "limits of writable entries, if there are any", S),
    Case("4.7", "OD 07", "access every entry of the device as its access type says", P),
    Case("4.8", "OD 08", "entries of the device have the default value of the EDS", F),
    Case("4.9", "OD 09", "writable entries of the device take their own value back", P),
    Case("5.1", "Emergency 01", "1014h holds the right COB-ID", P),
    Case("5.2", "Emergency 02", "read 1001h", P),
    Case("5.3", "Emergency 03", "read 1003h:01", P),
    Case("5.4", "Emergency 04", "an RPDO without data brings an EMCY message", P),
    Case("5.5", "Emergency 05", "read 1001h after it", P),
    Case("5.6", "Emergency 06", "1003h:01 is what the message said", F),
    Case("6.1", "Synchronization 01", "1005h holds 80h", P),
    Case("6.2", "Synchronization 02", "count the SYNCs of a producer", P),
    Case("6.3", "Synchronization 03", "count the TPDOs of type 10", P),
    Case("6.4", "Synchronization 04", "a consumer takes 0 into 1006h", P),
    Case("6.5", "Synchronization 05", "1019h does not take 1", P),
    Case("6.6", "Synchronization 06", "1019h takes 0, and the SYNC has no counter", P),
    Case("6.7", "Synchronization 07", "the counter of a producer", P),
    Case("6.8", "Synchronization 08", "the counter is saved and there after a reset", P),
    Case("6.9", "Synchronization 09", "1019h cannot be written while a period is set", P),
    Case("6.10", "Synchronization 10", "1005h, 1006h and 1019h can be saved", P),
    Case("7.1", "Guarding 01", "read 100Ch and 100Dh", S),
    Case("7.2", "Guarding 02", "a remote frame is answered", S),
    Case("7.3", "Guarding 03", "the toggle bit", S),
    Case("7.4", "Guarding 04", "identifiers of guarding", S),
    Case("7.5", "Guarding 05", "write 100Ch and 100Dh", S),
    Case("7.6", "Guarding 06", "life guarding", S),
    Case("7.101", "Heartbeat 01", "write 1017h", P),
    Case("7.102", "Heartbeat 02", "count the heartbeats", P),
    Case("7.103", "Heartbeat 03", "switch the heartbeat off", P),
    Case("7.104", "Heartbeat 04", "the same node twice in 1016h is refused", P),
    Case("7.105", "Heartbeat 05", "consumer: heartbeats in time", P),
    Case("7.106", "Heartbeat 06", "consumer: heartbeats too late", P),
    Case("7.107", "Heartbeat 07", "consumer: from a reset on, with the end of OPERATIONAL", P),
    Case("7.201", "Heartbeat versus guarding 01", "objects of heartbeat and guarding", P),
    Case("7.202", "Heartbeat versus guarding 02", "switch the heartbeat off", S),
    Case("7.203", "Heartbeat versus guarding 03", "guarding", S),
    Case("7.204", "Heartbeat versus guarding 04", "heartbeat on, guarding off", S),
    Case("7.205", "Heartbeat versus guarding 05", "heartbeat on, guarding off, remote frames", S),
    Case("7.206", "Heartbeat versus guarding 06", "heartbeat on, guarding on", S),
    Case("7.207", "Heartbeat versus guarding 07", "heartbeat on, guarding on, remote frames", S),
    Case("8.1", "Testing other 01", "1010h:01 refuses a wrong signature", S),
    Case("8.2", "Testing other 02", "1010h:01 saves, and the values are there after a reset", S),
    Case("8.3", "Testing other 03", "1011h:01 refuses a wrong signature", P),
    Case("8.4", "Testing other 04", "1011h:01 restores the defaults", P),
    Case("8.5", "Testing other 05", "1010h:02 refuses a wrong signature", P),
    Case("8.6", "Testing other 06", "1010h:02 saves, and the values are there after a reset", P),
    Case("8.7", "Testing other 07", "1011h:02 refuses a wrong signature", P),
    Case("8.8", "Testing other 08", "1011h:02 restores the defaults", P),
    Case("8.9", "Testing other 09", "1020h, if it exists, is saved", S, S, "there is no 1020h"),
    Case("8.10", "Testing other 10", "restricted CAN-IDs are refused by every COB-ID", S),
    Case("9.1", "State 01", "reset: boot-up message, and defaults after random values", P),
    Case("9.2", "State 02", "PRE-OPERATIONAL: boot-up, SDO, heartbeat, SYNC, no PDO", P),
    Case("9.3", "State 03", "OPERATIONAL: SDO, heartbeat, SYNC, PDO", P),
    Case("9.4", "State 04", "STOPPED: heartbeat, and nothing else", P),
    Case("10.1", "Transition 01", "reset node and reset communication", P),
    Case("10.2", "Transition 02", "enter PRE-OPERATIONAL", P),
    Case("10.3", "Transition 03", "start", P),
    Case("10.4", "Transition 04", "stop", P),
)
