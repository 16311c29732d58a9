from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING

import pytest

from gatewayd.rtde import messages
from gatewayd.rtde import visit as visits
from gatewayd.rtde.fields import OUTPUTS
from gatewayd.rtde.loss import LossReason
from gatewayd.rtde.session import ClientSettings
from gatewayd.rtde.visit import Visit, visit

if TYPE_CHECKING:
    from tests.rtde.conftest import Controller

Until = Callable[..., Awaitable[None]]
MANY = tuple(name for name in OUTPUTS if name not in {"actual_qdd", "actual_moment"})


def settings(controller: Controller, *outputs: str, inputs: tuple[str, ...] = ()) -> ClientSettings:
    return ClientSettings(
        host="127.0.0.1", port=controller.port, outputs=outputs, inputs=inputs, handshake_timeout=0.3
    )


async def test_a_visit_brings_back_what_was_agreed_and_starts_nothing(controller: Controller) -> None:
    met = await visit(settings(controller, "actual_q", "robot_mode"))
    assert met.session is not None
    assert met.session.outputs.names == ("timestamp", "actual_q", "robot_mode")
    assert (met.loss, met.packages, met.rate) == (None, 0, None)
    assert messages.Start not in map(type, controller.peer.received)


async def test_listening_measures_the_rate_by_what_came(controller: Controller) -> None:
    met = await visit(settings(controller, "robot_mode"), 0.1)
    assert met.loss is None
    assert met.packages > 1
    assert met.rate == pytest.approx((met.packages - 1) / met.span)
    assert met.advance == pytest.approx((met.packages - 1) * controller.peer.period)


async def test_nothing_is_written_and_claims_end_with_the_visit(controller: Controller, until: Until) -> None:
    controller.script.in_use = {"input_int_register_3"}
    met = await visit(settings(controller, inputs=("input_int_register_2", "input_int_register_3")), 0.05)
    assert met.session is not None
    (recipe,) = met.session.inputs.values()
    assert recipe.recipe.names == ("input_int_register_2",)
    assert [missing.word for missing in met.session.unavailable] == ["IN_USE"]
    assert messages.DataPackage not in map(type, controller.peer.received)
    await until(controller.peer.writer.is_closing)


async def test_texts_are_brought_back(controller: Controller) -> None:
    controller.script.texts = True
    met = await visit(settings(controller, "robot_mode"))
    assert met.session is not None
    assert {text.message for text in met.texts} == {"SafetySetup has not been confirmed yet"}


@pytest.mark.parametrize("complains", [True, False])
async def test_a_controller_that_takes_no_long_list_is_asked_again_by_short_ones(
    controller: Controller, complains: bool
) -> None:
    controller.script.name_limit, controller.script.complains = 2048, complains
    met = await visit(settings(controller, *MANY))
    assert met.session is not None
    assert {missing.word for missing in met.session.unavailable} == {"TOO_LONG"}


async def test_who_does_not_answer_is_left_after_one_attempt(controller: Controller) -> None:
    controller.script.mute = {messages.RequestProtocolVersion}
    met = await visit(settings(controller, "robot_mode"))
    assert met.loss is not None
    assert met.loss.reason is LossReason.UNANSWERED
    assert len(controller.peers) == 1


async def test_who_refuses_is_reported(controller: Controller) -> None:
    await controller.shut()
    met = await visit(settings(controller, "robot_mode"))
    assert met.session is None
    assert met.loss is not None
    assert met.loss.reason is LossReason.REFUSED


async def test_silence_after_the_start_is_a_loss_with_its_session(
    controller: Controller, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(visits, "_FIRST_DATA", 0.1)
    controller.script.sends_data = False
    met = await visit(settings(controller, "robot_mode"), 0.1)
    assert met.session is not None
    assert met.loss is not None
    assert met.loss.reason is LossReason.SILENT


async def test_a_controller_that_never_gets_anywhere_takes_a_bounded_time(
    controller: Controller, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(visits, "_LIMIT", 0.1)
    controller.script.mute = {messages.SetupOutputs}
    met = await visit(settings(controller, *MANY))
    assert met == Visit(None, met.loss)
    assert met.loss is not None
    assert "waited 0.1 s in vain for the set-up to be complete" in met.loss.text


@asynccontextmanager
async def served(answer: bytes) -> AsyncIterator[int]:
    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.write(answer)
        await reader.read()
        writer.close()

    async with await asyncio.start_server(serve, "127.0.0.1", 0) as server:
        yield server.sockets[0].getsockname()[1]


@pytest.mark.parametrize(
    "answer, reason",
    [
        (b"HTTP/1.1 400 Bad Request\r\n\r\n", LossReason.UNANSWERED),
        (b"\x00\x00\x00", LossReason.PROTOCOL),
        (b"\x00\x05V\x01\x00", LossReason.UNANSWERED),
        (b"\xff\xffV", LossReason.UNANSWERED),
    ],
)
async def test_who_speaks_something_else_is_no_session(answer: bytes, reason: LossReason) -> None:
    async with served(answer) as port:
        met = await visit(ClientSettings(host="127.0.0.1", port=port, handshake_timeout=0.2))
    assert met.session is None
    assert met.loss is not None
    assert met.loss.reason is reason
