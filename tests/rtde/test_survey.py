from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.rtde import messages
from gatewayd.rtde import survey as surveys
from gatewayd.rtde.catalogue import OLD_LIST_LIMIT, list_size
from gatewayd.rtde.fields import INPUTS, OUTPUTS
from gatewayd.rtde.loss import LossReason
from gatewayd.rtde.session import ClientSettings
from gatewayd.rtde.survey import pieces, survey

if TYPE_CHECKING:
    from tests.rtde.conftest import Controller


def settings(controller: Controller) -> ClientSettings:
    return ClientSettings(host="127.0.0.1", port=controller.port, handshake_timeout=0.3)


async def test_every_field_is_answered_by_a_controller_of_short_lists(controller: Controller) -> None:
    script = controller.script
    script.name_limit, script.complains = OLD_LIST_LIMIT, True
    script.missing = {"payload_inertia", "input_int_register_40"}
    script.in_use = {"speed_slider_mask", "input_double_register_7"}
    found = await survey(settings(controller), tuple(OUTPUTS), tuple(INPUTS))
    assert (found.loss, found.texts) == (None, ())
    assert found.session is not None
    assert found.session.controller == script.version
    words = {name: field.type.word for name, field in OUTPUTS.items()}
    assert found.outputs == words | dict.fromkeys(script.missing & OUTPUTS.keys(), "NOT_FOUND")
    words = {name: field.type.word for name, field in INPUTS.items()}
    assert found.inputs == words | dict.fromkeys(script.in_use, "IN_USE") | {
        "input_int_register_40": "NOT_FOUND"
    }


async def test_without_inputs_nothing_is_claimed_and_nothing_is_ever_started(controller: Controller) -> None:
    await survey(settings(controller), ("robot_mode", "input_int_register_0", "unknown"))
    kinds = {type(message) for peer in controller.peers for message in peer.received}
    assert not kinds & {messages.SetupInputs, messages.Start, messages.DataPackage}


async def test_an_unknown_output_is_the_controllers_own_answer(controller: Controller) -> None:
    found = await survey(settings(controller), ("robot_mode", "unknown", "robot_mode"))
    assert found.outputs == {"robot_mode": "INT32", "unknown": "NOT_FOUND"}


async def test_what_was_answered_before_a_loss_stays(controller: Controller) -> None:
    controller.script.mute = {messages.SetupInputs}
    found = await survey(settings(controller), ("robot_mode",), ("input_int_register_0",))
    assert found.outputs == {"robot_mode": "INT32"}
    assert found.inputs == {}
    assert found.loss is not None
    assert found.loss.reason is LossReason.UNANSWERED


async def test_what_a_client_held_that_has_just_gone_is_asked_for_once_more(
    controller: Controller, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A controller notices the end of a connection late; our own last visit must not look like somebody else."""
    script = controller.script
    script.in_use = {"input_int_register_0", "input_int_register_1"}

    async def pass_by(_seconds: float) -> None:
        script.in_use.remove("input_int_register_0")

    monkeypatch.setattr(surveys, "asyncio", SimpleNamespace(sleep=pass_by))
    found = await survey(settings(controller), (), ("input_int_register_0", "input_int_register_1"))
    assert found.inputs == {"input_int_register_0": "INT32", "input_int_register_1": "IN_USE"}


@given(st.lists(st.text("ab_", min_size=1, max_size=30)), st.integers(30, 100))
def test_pieces_have_every_name_once_and_keep_to_the_limit(names: list[str], limit: int) -> None:
    cut = list(pieces(names, limit))
    assert sorted(name for piece in cut for name in piece) == sorted(set(names))
    assert all(0 < list_size(piece) <= limit for piece in cut)


@pytest.mark.parametrize("name", ["b" * 3000, "", "a,b", "a b", "a\x00", "größe"])
def test_what_cannot_be_a_name_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match="name of a field"):
        list(pieces(["a", name]))
