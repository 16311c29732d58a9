from __future__ import annotations

import math

from gatewayd.canopen.frame import Frame
from gatewayd.canopen.guarding import NodeGuarding
from gatewayd.canopen.nmt import NmtState
from tests.links.canopen_node.wire import Client, Wire, slave

ASK = Frame(0x705, remote=True, length=1)


class Guarded:
    """Guarding of node 5, with a notebook."""

    def __init__(self) -> None:
        self.wire = Wire()
        self.heartbeat = False
        self.calls: list[str] = []
        self.service = NodeGuarding(
            self.wire.send,
            slave(5, NmtState.OPERATIONAL),
            lambda: self.heartbeat,
            lost=lambda _now: self.calls.append("lost"),
            back=lambda _now: self.calls.append("back"),
        )
        self.client = Client(self.service.objects())

    def ask(self, now: float = 0.0) -> list[Frame]:
        self.service.receive(ASK, now)
        return self.wire.take()


def test_answers_with_a_toggle_bit_that_starts_with_0() -> None:
    guarded = Guarded()
    assert [guarded.ask()[0].data for _ in range(3)] == [b"\x05", b"\x85", b"\x05"]
    guarded.service.restart()
    assert guarded.ask() == [Frame(0x705, b"\x05")]


def test_heartbeat_has_precedence() -> None:
    guarded = Guarded()
    guarded.heartbeat = True
    assert guarded.ask() == []


def test_data_frames_are_no_requests() -> None:
    guarded = Guarded()
    guarded.service.receive(Frame(0x705, b"\x05"), 0.0)
    assert guarded.wire.take() == []


def test_life_guarding_starts_with_the_first_request() -> None:
    guarded = Guarded()
    guarded.client.write(0x100C, 0, 100)
    guarded.client.write(0x100D, 0, 3)
    assert guarded.service.next_deadline(0.0) == math.inf
    guarded.ask(10.0)
    assert guarded.service.next_deadline(10.0) == 10.3
    guarded.service.tick(10.29)
    assert guarded.calls == []
    guarded.service.tick(10.3)
    guarded.service.tick(20.0)
    assert guarded.calls == ["lost"]
    guarded.ask(30.0)
    guarded.ask(30.1)
    assert guarded.calls == ["lost", "back"]


def test_without_a_factor_there_is_no_supervision() -> None:
    guarded = Guarded()
    guarded.client.write(0x100C, 0, 100)
    guarded.ask(0.0)
    assert guarded.service.next_deadline(0.0) == math.inf
