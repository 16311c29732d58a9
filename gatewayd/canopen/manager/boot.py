"""The boot of one device after CiA 302-2, "boot slave process": from nothing known of it to ready to be started.

Each step asks the device questions by SDO, or waits for it; what follows from the answers is a table (`boot_steps`). A
step that fails ends the boot with a letter (`BootError`), and after a while the boot begins again, for ever: a device
that is plugged in at night has to come up by itself. A boot-up message begins it anew at any time. The device is asked
for 1000h as well as waited for, because its boot-up message may have been sent before anybody listened.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Protocol

from gatewayd.canopen.describe import object_text
from gatewayd.canopen.manager.boot_steps import NEXT, BootSignal, BootStep
from gatewayd.canopen.manager.channel import Done, reason_of
from gatewayd.canopen.manager.configuration import ExpectedObject, pdo_expectations, pdo_settings
from gatewayd.canopen.manager.letters import BootError
from gatewayd.canopen.manager.plan import NodePlan, Setting
from gatewayd.canopen.nmt import NmtCommand, NmtState
from gatewayd.canopen.sdo.client import SdoResult

SETTLE = 0.02
"""Seconds after a boot-up message in which a device is left alone; more of them within it count as one."""
RETRY_SILENT = 1.0
"""Seconds until a device that did not answer is asked again."""
RETRY = 5.0
"""Seconds until the boot of a device begins again that has failed."""
ATTEMPTS = 2
"""How often a device is asked that has answered before."""
SAVE = b"save"


_SILENCES = (BootError.NO_ANSWER, BootError.HEARTBEAT)

Judge = Callable[[bytes], str]
"""What is wrong with a value, in words; empty if nothing is."""


@dataclass(frozen=True, slots=True)
class Question:
    """One transfer of a step."""

    index: int
    subindex: int
    write: bytes | None = None
    judge: Judge = lambda _data: ""
    optional: bool = False
    """A device that has no such object is as good."""


class BootDevice(Protocol):
    """The device as its boot sees it."""

    def ask(self, index: int, subindex: int, data: bytes | None, done: Done, now: float) -> None:
        """Read an object, or write it."""

    def forget(self) -> None:
        """Drop all transfers that are not done."""

    def command(self, command: NmtCommand, now: float) -> None:
        """Send it an NMT command."""

    def identified(self, subindex: int, number: int) -> None:
        """1018h has said so; sub-index 0 stands for 1000h."""

    def output(self, index: int, subindex: int, data: bytes) -> None:
        """What an object of an RPDO holds, before anything is sent to it."""

    def ready(self, now: float) -> None:
        """It may be started."""

    def failed(self, now: float) -> None:
        """The boot has ended with a letter."""


class Boot:
    """The boot of one device."""

    def __init__(self, plan: NodePlan, device: BootDevice) -> None:
        self._plan = plan
        self._device = device
        self.step = BootStep.IDLE
        self.letter: BootError | None = None
        """Why the last boot has failed; L if it has not and found the device in operation; None otherwise."""
        self.detail = ""
        """What exactly the device said, in words."""
        self._fresh = self._kept = False
        self._questions: deque[Question] = deque()
        self._attempts = 0
        self._state: int | None = None
        """What a heartbeat has said since the step began."""
        self._due = math.inf
        self._round = 0

    @property
    def is_kept(self) -> bool:
        """Whether the device was found in operation, and left so."""
        return self._kept

    def begin(self, now: float, *, fresh: bool) -> None:
        """Begin, or begin again. `fresh`: the device has just sent its boot-up message."""
        self._device.forget()
        self._fresh, self._kept = fresh, False
        if fresh:
            self._enter(BootStep.SETTLING, now)
            self._due = now + SETTLE
        else:
            self._enter(BootStep.TYPE, now)

    def stop(self) -> None:
        """The bus is gone: nothing is asked any more."""
        self._device.forget()
        self.step, self._due = BootStep.IDLE, math.inf
        self._questions.clear()
        self._round += 1

    def boot_up(self, now: float) -> None:
        """The device has sent its boot-up message."""
        if self.step is BootStep.RESET:
            self._fresh = True
            self._due = now + SETTLE
        elif self.step is BootStep.SETTLING:
            self._due = max(self._due, now + SETTLE)
        elif self.step is not BootStep.IDLE:
            self.begin(now, fresh=True)

    def heartbeat(self, state: int, now: float) -> None:
        """The device has sent a heartbeat with its NMT state.

        Some send the first one before they confirm that its time was written: it counts when that is confirmed.
        """
        self._state = state
        if not self._questions and self.step in (BootStep.STATE, BootStep.ERROR_CONTROL):
            self._judge_heartbeat(now)

    def _judge_heartbeat(self, now: float) -> None:
        if self.step is BootStep.ERROR_CONTROL:
            self._end(BootSignal.GOOD, "", now)
        else:
            found = self._state == NmtState.OPERATIONAL
            self._end(BootSignal.OPERATIONAL if found else BootSignal.OTHER, "", now)

    def started(self) -> None:
        """It was sent the command to start."""
        self.step = BootStep.RUNNING

    def fail(self, letter: BootError, detail: str, now: float) -> None:
        """End with a letter; begin again after a while."""
        self.step, self.letter, self.detail = BootStep.FAILED, letter, detail
        self._questions.clear()
        self._due = now + (RETRY_SILENT if letter in _SILENCES else RETRY)
        self._device.failed(now)

    def tick(self, now: float) -> None:
        """What time leads to."""
        if now < self._due:
            return
        self._due = math.inf
        if self.step is BootStep.FAILED:
            self.begin(now, fresh=False)
        elif self.step is BootStep.SETTLING:
            self._enter(BootStep.TYPE, now)
        elif self.step is BootStep.RESET and self._fresh:
            self._end(BootSignal.GOOD, "", now)
        else:
            self._end(BootSignal.SILENT, self._silence(), now)

    def next_deadline(self) -> float:
        """When `tick` has something to do."""
        return self._due

    def spare(self, time: float) -> None:
        """The process stood still for so many seconds."""
        self._due += time

    # -- inside --------------------------------------------------------------------------------------------------

    def _enter(self, step: BootStep, now: float) -> None:
        self.step, self._due, self._state = step, math.inf, None
        self._round += 1
        act = self.ENTRIES.get(step)
        self._questions = deque(act(self, now) if act is not None else ())
        self._attempts = 0
        self._go_on(now)

    def _go_on(self, now: float) -> None:
        """Ask the next question; without one, the step is over or waits for the device."""
        if self._questions:
            question, round_ = self._questions[0], self._round

            def done(result: SdoResult, now: float) -> None:
                if round_ == self._round and self._questions and self._questions[0] is question:
                    self._answered(question, result, now)

            self._device.ask(question.index, question.subindex, question.write, done, now)
        elif self.step is BootStep.READY:
            self._arrived(now)
        elif self.step in self.WAITS:
            self.WAITS[self.step](self, now)
        elif self.step in self.ENTRIES:
            self._end(BootSignal.GOOD, "", now)

    def _answered(self, question: Question, result: SdoResult, now: float) -> None:
        if result.silent and self._attempts + 1 < ATTEMPTS and self.step is not BootStep.TYPE:
            self._attempts += 1
            self._go_on(now)
            return
        problem = question.judge(result.data) if result.good else reason_of(result)
        if not problem or (question.optional and not result.good and not result.silent):
            self._questions.popleft()
            self._attempts = 0
            self._go_on(now)
            return
        signal = (
            BootSignal.SILENT
            if result.silent
            else BootSignal.DIFFERENT
            if result.good
            else BootSignal.REFUSED
        )
        what = "" if result.good else "write " if question.write is not None else "read "
        self._end(signal, f"{what}{object_text(question.index, question.subindex)}: {problem}", now)

    def _end(self, signal: BootSignal, detail: str, now: float) -> None:
        follows = NEXT[self.step, signal]
        if self.step is BootStep.STATE and signal is BootSignal.OPERATIONAL:
            self._kept = True
        if isinstance(follows, BootStep):
            self._enter(follows, now)
        else:
            self._questions.clear()
            self._round += 1
            self.fail(follows, detail, now)

    def _arrived(self, now: float) -> None:
        self.letter = BootError.OPERATIONAL if self._kept else None
        self.detail = ""
        self._device.ready(now)

    def _silence(self) -> str:
        if self.step is BootStep.RESET:
            return f"no boot-up message within {self._plan.boot_time:g} s of the reset of its communication"
        return f"no heartbeat within {self._plan.heartbeat:g} s"

    # -- the questions of the steps ------------------------------------------------------------------------------

    def _ask_type(self, _now: float) -> list[Question]:
        return [self._identity(0x1000, 0, 0, self._plan.expected.device_type)]

    def _ask_vendor(self, _now: float) -> list[Question]:
        return [self._identity(0x1018, 1, 1, self._plan.expected.vendor)]

    def _ask_product(self, _now: float) -> list[Question]:
        return [self._identity(0x1018, 2, 2, self._plan.expected.product)]

    def _ask_revision(self, _now: float) -> list[Question]:
        return [self._identity(0x1018, 3, 3, self._plan.expected.revision)]

    def _ask_serial(self, _now: float) -> list[Question]:
        return [self._identity(0x1018, 4, 4, self._plan.expected.serial)]

    def _identity(self, index: int, subindex: int, number: int, expected: int | None) -> Question:
        def judge(data: bytes) -> str:
            found = int.from_bytes(data[:4], "little")
            self._device.identified(number, found)
            return _difference(found, expected) if expected is not None else ""

        return Question(index, subindex, judge=judge, optional=expected is None and index != 0x1000)

    def _ask_state(self, _now: float) -> list[Question]:
        """A heartbeat tells the state; a device that has none cannot be known to be in operation."""
        return (
            self._heartbeat_settings() if self._plan.keep and not self._fresh and self._plan.heartbeat else []
        )

    def _heartbeat_settings(self) -> list[Question]:
        if not self._plan.heartbeat or not self._plan.producer:
            return []
        return [Question(0x1017, 0, write=self._plan.producer.to_bytes(2, "little"))]

    def _wait_for_state(self, now: float) -> None:
        if self._fresh:
            self._end(BootSignal.FRESH, "", now)
        elif not self._plan.keep or not self._plan.heartbeat:
            self._end(BootSignal.OTHER, "", now)
        elif self._state is not None:
            self._judge_heartbeat(now)
        else:
            self._due = now + self._plan.heartbeat

    def _compare_all(self, now: float) -> list[Question]:
        written = self._ask_date(now) or [_expecting(item) for item in self._layouts(written=True)]
        return written + self._compare_pdos(now)

    def _compare_pdos(self, _now: float) -> list[Question]:
        return [_expecting(item) for item in self._layouts(written=False)]

    def _reset(self, now: float) -> list[Question]:
        self._kept, self._fresh = False, False
        self._device.command(NmtCommand.RESET_COMMUNICATION, now)
        return []

    def _wait_for_boot_up(self, now: float) -> None:
        self._due = now + self._plan.boot_time

    def _ask_software(self, _now: float) -> list[Question]:
        expected = self._plan.software
        if expected is None:
            return []

        def judge(data: bytes) -> str:
            found = data.rstrip(b"\0 ").decode("latin-1")
            return "" if found == expected else f"is {found!r} instead of {expected!r}"

        return [Question(0x100A, 0, judge=judge)]

    def _ask_date(self, _now: float) -> list[Question]:
        """A device that says it has the planned configuration is believed, but for its PDOs: these are compared."""
        configured = self._plan.configured
        if configured is None:
            return []
        dates = (ExpectedObject(0x1020, subindex, number) for subindex, number in enumerate(configured, 1))
        return [_expecting(item) for item in (*dates, *self._layouts(written=True))]

    def _judge_date(self, now: float) -> None:
        self._end(BootSignal.GOOD if self._plan.configured is not None else BootSignal.DIFFERENT, "", now)

    def _layouts(self, *, written: bool) -> list[ExpectedObject]:
        pdos = (pdo for pdo in self._plan.pdos if pdo.written is written)
        return [item for pdo in pdos for item in pdo_expectations(pdo)]

    def _configure(self, _now: float) -> list[Question]:
        settings = [*self._plan.settings]
        for pdo in self._plan.pdos:
            if pdo.written:
                settings += pdo_settings(pdo)
        if self._plan.configured is not None:
            for subindex, number in enumerate(self._plan.configured, 1):
                settings.append(Setting(0x1020, subindex, number.to_bytes(4, "little")))
        if self._plan.store:
            settings.append(Setting(0x1010, 1, SAVE))
        return [Question(item.index, item.subindex, write=item.data) for item in settings]

    def _read_content(self, _now: float) -> list[Question]:
        """What a device holds is what an RPDO sends of it until somebody writes something else."""
        return [
            Question(
                item.index, item.subindex, judge=self._take_output(item.index, item.subindex), optional=True
            )
            for pdo in self._plan.pdos
            if not pdo.transmit
            for item in pdo.objects
            if item.index >= 0x1000
        ]

    def _take_output(self, index: int, subindex: int) -> Judge:
        def take(data: bytes) -> str:
            self._device.output(index, subindex, data)
            return ""

        return take

    def _wait_for_heartbeat(self, now: float) -> None:
        if self._plan.heartbeat and self._state is None:
            self._due = now + self._plan.heartbeat
        else:
            self._end(BootSignal.GOOD, "", now)

    def _set_up_heartbeat(self, _now: float) -> list[Question]:
        return self._heartbeat_settings()

    def _none(self, _now: float) -> list[Question]:
        return []

    ENTRIES: ClassVar[dict[BootStep, Callable[[Boot, float], list[Question]]]] = {
        BootStep.TYPE: _ask_type,
        BootStep.VENDOR: _ask_vendor,
        BootStep.PRODUCT: _ask_product,
        BootStep.REVISION: _ask_revision,
        BootStep.SERIAL: _ask_serial,
        BootStep.STATE: _ask_state,
        BootStep.KEPT: _compare_all,
        BootStep.RESET: _reset,
        BootStep.SOFTWARE: _ask_software,
        BootStep.DATE: _ask_date,
        BootStep.CONFIGURE: _configure,
        BootStep.PDOS: _compare_pdos,
        BootStep.CONTENT: _read_content,
        BootStep.ERROR_CONTROL: _set_up_heartbeat,
        BootStep.READY: _none,
    }
    """What is asked when a step begins."""
    WAITS: ClassVar[dict[BootStep, Callable[[Boot, float], None]]] = {
        BootStep.STATE: _wait_for_state,
        BootStep.RESET: _wait_for_boot_up,
        BootStep.DATE: _judge_date,
        BootStep.ERROR_CONTROL: _wait_for_heartbeat,
    }
    """What comes when everything was answered; where nothing is listed, the step has ended well."""


def _expecting(item: ExpectedObject) -> Question:
    def judge(data: bytes) -> str:
        return _difference(int.from_bytes(data[:4], "little") & item.mask, item.number & item.mask)

    return Question(item.index, item.subindex, judge=judge)


def _difference(found: int, expected: int) -> str:
    return "" if found == expected else f"is {found:08X}h instead of {expected:08X}h"
