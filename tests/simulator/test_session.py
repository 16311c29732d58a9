"""One connection's protocol, without sockets: the project's own codec on the other side."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.rtde.codec import ClientProtocol, ProtocolError
from gatewayd.rtde.fields import INPUTS, OUTPUTS, Series
from gatewayd.rtde.messages import (
    ControllerMessage,
    ControllerVersion,
    DataPackage,
    ExecutableMessage,
    GetControllerVersion,
    InputsSetup,
    OutputsSetup,
    Pause,
    PauseReply,
    ProtocolVersionReply,
    RequestProtocolVersion,
    SetupInputs,
    SetupOutputs,
    Start,
    StartReply,
    TextLevel,
    TextMessage,
)
from gatewayd.rtde.strange import StrangePackage
from gatewayd.simulator.controller import Controller
from gatewayd.simulator.faults import DropAt, DroppedError, Faults, FaultStep, LongLists
from gatewayd.simulator.session import SimulatorSession

INT = "input_int_register_{}".format


class Peer:
    """A client's codec wired to a session."""

    def __init__(self, controller: Controller, version: int = 2) -> None:
        self.controller = controller
        self.session = SimulatorSession(controller, "peer")
        self.protocol = ClientProtocol()
        if version == 2:
            assert self.ask(RequestProtocolVersion(2)) == [ProtocolVersionReply(accepted=True)]

    def ask(self, *messages: ExecutableMessage) -> list[ControllerMessage]:
        data = b"".join(map(self.protocol.send, messages))
        return self.answers(self.session.receive(data))

    def cycle(self) -> list[ControllerMessage]:
        self.controller.advance()
        return self.answers(self.session.package())

    def answers(self, data: bytes) -> list[ControllerMessage]:
        answers: list[ControllerMessage] = []
        for message in self.protocol.receive(data):
            assert not isinstance(message, StrangePackage)
            answers.append(message)
        return answers


@pytest.fixture
def controller() -> Controller:
    return Controller()


@pytest.fixture
def peer(controller: Controller) -> Peer:
    return Peer(controller)


def text(messages: list[ControllerMessage]) -> str:
    (message,) = messages
    assert isinstance(message, TextMessage)
    assert message.level == TextLevel.ERROR
    return message.message


@pytest.mark.parametrize("version,accepted", [(0, False), (1, True), (2, True), (3, False), (65535, False)])
def test_versions_1_and_2_are_spoken(controller: Controller, version: int, accepted: bool) -> None:
    assert Peer(controller, 1).ask(RequestProtocolVersion(version)) == [ProtocolVersionReply(accepted)]


def test_a_version_1_controller_refuses_2() -> None:
    peer = Peer(Controller(Series.CB3, faults=Faults(v1_only=True)), 1)
    assert peer.ask(RequestProtocolVersion(2), RequestProtocolVersion(1)) == [
        ProtocolVersionReply(accepted=False),
        ProtocolVersionReply(accepted=True),
    ]
    assert peer.ask(SetupOutputs(("timestamp", "robot_mode"))) == [OutputsSetup(None, ("DOUBLE", "INT32"))]
    assert peer.ask(Start()) == [StartReply(accepted=True)]
    assert peer.cycle() == [DataPackage(None, struct.pack(">di", 100.008, 7))]


def test_several_requests_in_one_segment_are_answered_in_order(peer: Peer) -> None:
    answers = peer.ask(
        GetControllerVersion(), SetupOutputs(("timestamp",), 125.0), SetupInputs((INT(0),)), Start(), Pause()
    )
    assert answers == [
        ControllerVersion(5, 12, 0, 0),
        OutputsSetup(1, ("DOUBLE",)),
        InputsSetup(1, ("INT32",)),
        StartReply(accepted=True),
        PauseReply(accepted=True),
    ]


def test_a_trailing_comma_is_no_name(peer: Peer) -> None:
    for kind, head in ((b"O", struct.pack(">d", 125.0)), (b"I", b"")):
        payload = head + b"input_int_register_0,input_double_register_0,"
        reply = peer.session.receive(struct.pack(">H", 3 + len(payload)) + kind + payload)
        assert reply[3:] == b"\x01INT32,DOUBLE"


def test_an_empty_name_is_not_found_and_an_empty_input_recipe_not_confirmed(peer: Peer) -> None:
    assert peer.ask(SetupOutputs(("timestamp", "", "robot_mode"), 0.0)) == [
        OutputsSetup(0, ("DOUBLE", "NOT_FOUND", "INT32"))
    ]
    assert peer.ask(SetupOutputs((), 0.0)) == [OutputsSetup(0, ())]
    assert peer.ask(SetupInputs(())) == []


def test_an_output_recipe_of_missing_fields_cannot_be_started(peer: Peer) -> None:
    assert peer.ask(Start()) == [StartReply(accepted=False)]
    peer.ask(SetupOutputs(("timestamp", "control_step"), 0.0))
    assert peer.ask(Start()) == [StartReply(accepted=False)]
    assert peer.cycle() == []


def test_a_second_output_recipe_replaces_the_first_while_running(peer: Peer) -> None:
    peer.ask(SetupOutputs(("timestamp",), 0.0), Start())
    peer.ask(SetupOutputs(("robot_mode",), 0.0))
    assert peer.cycle() == [DataPackage(1, struct.pack(">i", 7))]
    peer.ask(SetupOutputs(("nothing",), 0.0))
    assert peer.cycle() == []


def test_packages_come_at_multiples_of_the_period_and_pause_stops_them(peer: Peer) -> None:
    peer.ask(SetupOutputs(("timestamp",), 125.0), Start())
    sent = [len(peer.cycle()) for _ in range(12)]
    assert sent == [0, 0, 0, 1] * 3
    assert peer.ask(Pause(), Pause()) == [PauseReply(accepted=True)] * 2
    assert not any(peer.cycle() for _ in range(8))
    assert peer.ask(Start()) == [StartReply(accepted=True)]
    assert any(peer.cycle() for _ in range(4))


def test_input_recipes_count_from_1_to_255(peer: Peer) -> None:
    for number in range(1, 256):
        assert peer.ask(SetupInputs((INT(23),))) == [InputsSetup(number, ("INT32",))]
    refused = peer.ask(SetupInputs((INT(0),)))
    assert refused[-1] == InputsSetup(0, ("INT32",))
    assert peer.controller.claims.owner(INT(0)) is None


def test_inputs_work_without_outputs_and_start_and_read_back(peer: Peer) -> None:
    peer.ask(SetupInputs((INT(18), "input_double_register_18")), SetupInputs(("input_bit_registers0_to_31",)))
    assert (
        peer.ask(DataPackage(1, struct.pack(">id", -5, 0.25)), DataPackage(2, struct.pack(">I", 0x80000001)))
        == []
    )
    peer.ask(SetupOutputs((INT(18), "input_double_register_18", "input_bit_registers0_to_31"), 0.0), Start())
    assert peer.cycle() == [DataPackage(1, struct.pack(">idI", -5, 0.25, 0x80000001))]


def test_an_input_package_nobody_knows_is_reported_and_ignored(peer: Peer) -> None:
    peer.ask(SetupInputs((INT(0),)))
    assert text(peer.ask(DataPackage(2, b"\0" * 4))) == "data package for unknown input recipe 2"
    assert text(peer.ask(DataPackage(0, b"\0" * 4))) == "data package for unknown input recipe 0"
    assert "input recipe 1" in text(peer.ask(DataPackage(1, b"\xff" * 5)))
    assert peer.controller.get(INT(0)) == (0,)


def test_one_field_in_use_costs_the_recipe_and_claims_nothing(controller: Controller) -> None:
    one, two = Peer(controller), Peer(controller)
    one.ask(SetupInputs((INT(1),)))
    names = (INT(0), INT(1), "input_double_register_0", "nothing")
    assert two.ask(SetupInputs(names)) == [InputsSetup(0, ("INT32", "IN_USE", "DOUBLE", "NOT_FOUND"))]
    assert controller.claims.owner(INT(0)) is None
    assert two.ask(SetupInputs((INT(0), "input_double_register_0"))) == [InputsSetup(1, ("INT32", "DOUBLE"))]


def test_claims_end_with_the_connection_and_values_stay(controller: Controller) -> None:
    one, two = Peer(controller), Peer(controller)
    one.ask(SetupInputs((INT(1),)), DataPackage(1, struct.pack(">i", 9)))
    one.session.close()
    assert two.ask(SetupInputs((INT(1),))) == [InputsSetup(1, ("INT32",))]
    assert controller.get(INT(1)) == (9,)


def test_an_output_is_no_input(peer: Peer) -> None:
    assert peer.ask(SetupInputs(("output_int_register_0",))) == [InputsSetup(0, ("NOT_FOUND",))]


def test_masks_are_honoured(peer: Peer) -> None:
    peer.ask(
        SetupInputs(("standard_digital_output_mask", "standard_digital_output")), DataPackage(1, b"\x04\xff")
    )
    assert peer.controller.get("actual_digital_output_bits") == (4,)


MANY = tuple(name for name in INPUTS if "int_register" in name or "double_register" in name)
MANY_TYPES = ("INT32",) * 48 + ("DOUBLE",) * 48


def test_a_list_beyond_2048_bytes_is_answered_with_id_0() -> None:
    peer = Peer(Controller(faults=Faults(long_lists=LongLists.REFUSE)))
    assert peer.ask(SetupInputs(MANY)) == [InputsSetup(0, MANY_TYPES)]
    assert peer.controller.claims.held(peer.session) == ()
    assert peer.ask(SetupOutputs(MANY, 0.0)) == [OutputsSetup(0, MANY_TYPES)]
    assert peer.ask(Start()) == [StartReply(accepted=False)]
    assert peer.ask(SetupInputs(MANY[:80]))[0] == InputsSetup(1, MANY_TYPES[:80])


def test_a_list_beyond_2048_bytes_is_not_answered() -> None:
    peer = Peer(Controller(faults=Faults(long_lists=LongLists.IGNORE)))
    assert peer.ask(SetupInputs(MANY)) == []
    assert peer.ask(SetupOutputs(MANY, 0.0)) == []


def test_a_list_beyond_2048_bytes_ends_the_connection() -> None:
    peer = Peer(Controller(faults=Faults(long_lists=LongLists.CLOSE)))
    with pytest.raises(DroppedError, match="longer than 2048"):
        peer.ask(SetupOutputs(MANY, 0.0))


def test_a_connection_is_dropped_at_the_step_that_was_named() -> None:
    peer = Peer(Controller(faults=Faults(drop_at=DropAt(FaultStep.OUTPUTS, 2))))
    assert peer.ask(SetupOutputs(("timestamp",), 0.0), Start())
    with pytest.raises(DroppedError, match="fault at outputs:2"):
        peer.ask(SetupOutputs(("timestamp",), 0.0))
    assert peer.ask(SetupOutputs(("timestamp",), 0.0))


def test_a_connection_is_dropped_in_place_of_a_package() -> None:
    peer = Peer(Controller(faults=Faults(drop_at=DropAt(FaultStep.DATA, 2))))
    peer.ask(SetupOutputs(("timestamp",), 0.0), Start())
    assert len(peer.cycle()) == 1
    with pytest.raises(DroppedError, match="fault at data:2"):
        peer.cycle()


def test_what_is_unreadable_can_be_claimed() -> None:
    peer = Peer(Controller(faults=Faults(unreadable=frozenset(MANY[:1]))))
    assert peer.ask(SetupInputs(MANY[:1])) == [InputsSetup(1, ("INT32",))]
    assert peer.ask(SetupOutputs(MANY[:2], 0.0)) == [OutputsSetup(0, ("NOT_FOUND", "INT32"))]


def test_a_list_beyond_2048_bytes_is_complained_of() -> None:
    peer = Peer(Controller(faults=Faults(long_lists=LongLists.COMPLAIN)))
    names = MANY
    assert text(peer.ask(SetupInputs(names))) == "list of 2235 bytes is longer than 2048"
    assert peer.ask(SetupInputs(names[:80]))[0] == InputsSetup(1, ("INT32",) * 48 + ("DOUBLE",) * 32)


def test_what_is_not_laid_out_as_its_type_says_is_complained_of_and_costs_no_connection() -> None:
    peer = Peer(Controller())
    peer.ask(SetupOutputs(("timestamp",), 0.0))
    short, long = bytes.fromhex("0004 4f 00"), bytes.fromhex("0004 53 00")
    assert text(peer.answers(peer.session.receive(short))).startswith("SETUP_OUTPUTS with payload of 1 byte")
    complaint, started = peer.answers(peer.session.receive(long))
    assert text([complaint]) == "START with payload of 1 byte, 0 expected"
    assert started == StartReply(accepted=True)


def test_a_greeting_comes_in_version_1_layout() -> None:
    peer = Peer(Controller(faults=Faults(text_on_connect="not confirmed")), 1)
    greeting = peer.session.greeting()
    assert greeting == struct.pack(">HBB", 17, ord("M"), TextLevel.WARNING) + b"not confirmed"
    assert list(peer.protocol.receive(greeting)) == [TextMessage("not confirmed", "", TextLevel.WARNING)]


def test_silence_sends_no_packages_but_answers(peer: Peer) -> None:
    peer.controller.faults.silence = True
    assert peer.ask(SetupOutputs(("timestamp",), 0.0), Start())[-1] == StartReply(accepted=True)
    assert peer.cycle() == []


def test_recipes_too_large_for_a_package_are_refused(peer: Peer) -> None:
    values = peer.ask(SetupOutputs(("actual_q",) * 1400, 0.0))
    assert [type(message) for message in values] == [TextMessage, OutputsSetup]
    types = peer.ask(SetupOutputs(("x",) * 30000, 0.0))
    assert text(types) == "the list of types is larger than a package"
    assert peer.ask(Start()) == [StartReply(accepted=False)]


def test_the_whole_catalogue_fits_one_recipe() -> None:
    controller = Controller(Series.X)
    names = tuple(name for name in {**INPUTS, **OUTPUTS} if controller.output_type(name))
    peer = Peer(controller)
    (reply,) = peer.ask(SetupOutputs(names, 0.0))
    assert isinstance(reply, OutputsSetup)
    assert reply.recipe == 1
    peer.ask(Start())
    (package,) = peer.cycle()
    assert isinstance(package, DataPackage)
    assert len(package.payload) > 2900


def test_bytes_that_are_no_rtde_are_an_error(peer: Peer) -> None:
    with pytest.raises(ProtocolError):
        peer.session.receive(b"\0\0\0")


@given(st.lists(st.binary(max_size=40), max_size=6))
def test_any_payloads_are_answered_or_refused(payloads: list[bytes]) -> None:
    session = SimulatorSession(Controller(), "fuzz")
    try:
        for number, payload in enumerate(payloads):
            kind = b"VvMUOISP"[(number + len(payload)) % 8]
            session.receive(struct.pack(">HB", 3 + len(payload), kind) + payload)
    except ProtocolError:
        pass
    finally:
        session.close()
