from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.canopen.frame import Frame
from gatewayd.canopen.nmt import ALLOWED, TRANSITIONS, UNCONFIGURED, NmtCommand, NmtSlave, NmtState, Service
from tests.links.canopen_node.wire import Wire

NODE = 5
BOOT_UP = Frame(0x705, b"\0")


class Plant:
    """A slave with a notebook."""

    def __init__(self, node: int = NODE, *, autostart: bool = False) -> None:
        self.wire = Wire()
        self.node = node
        self.resets: list[NmtCommand] = []
        self.changes: list[tuple[NmtState, NmtState]] = []
        self.nmt = NmtSlave(
            self.wire.send, lambda: self.node, self._changed, self._reset, autostart=autostart
        )

    def _changed(self, old: NmtState, new: NmtState, now: float) -> None:
        self.changes.append((old, new))

    def _reset(self, command: NmtCommand, now: float) -> None:
        assert self.nmt.state is NmtState.INITIALISING
        self.resets.append(command)

    def command(self, *data: int) -> NmtState:
        self.nmt.receive(Frame(0, bytes(data)), 1.0)
        return self.nmt.state


@pytest.fixture
def plant() -> Plant:
    plant = Plant()
    plant.nmt.boot(0.0)
    return plant


def test_cct_state_01_boot_up_then_pre_operational(plant: Plant) -> None:
    assert plant.wire.take() == [BOOT_UP]
    assert plant.nmt.state is NmtState.PRE_OPERATIONAL


@pytest.mark.parametrize(
    "start", [NmtState.STOPPED, NmtState.OPERATIONAL, NmtState.PRE_OPERATIONAL], ids=lambda state: state.name
)
@pytest.mark.parametrize(
    "command, reached",
    [
        (1, NmtState.OPERATIONAL),
        (2, NmtState.STOPPED),
        (128, NmtState.PRE_OPERATIONAL),
        (129, NmtState.PRE_OPERATIONAL),
        (130, NmtState.PRE_OPERATIONAL),
    ],
)
@pytest.mark.parametrize("address", [0, NODE])
def test_cct_transition_01_every_command_from_every_state(
    plant: Plant, start: NmtState, command: int, reached: NmtState, address: int
) -> None:
    plant.nmt.state = start
    assert plant.command(command, address) is reached


@pytest.mark.parametrize("command", [129, 130])
def test_cct_transition_02_resets_restore_parameters_then_boot_again(plant: Plant, command: int) -> None:
    plant.command(1, NODE)
    plant.wire.take()
    plant.command(command, NODE)
    assert plant.resets == [NmtCommand(command)]
    assert plant.wire.take() == [BOOT_UP]


@pytest.mark.parametrize(
    "data",
    [(), (1,), (1, NODE, 0), (1, 6), (1, 128 + NODE), (0, NODE), (3, NODE), (80, NODE), (96, NODE), (255, 0)],
)
def test_cct_transition_03_other_nodes_unknown_commands_and_lengths_are_ignored(
    plant: Plant, data: tuple[int, ...]
) -> None:
    assert plant.command(*data) is NmtState.PRE_OPERATIONAL
    assert (plant.resets, len(plant.changes)) == ([], 1)


def test_remote_frames_command_nothing(plant: Plant) -> None:
    plant.nmt.receive(Frame(0, remote=True, length=2), 1.0)
    assert plant.nmt.state is NmtState.PRE_OPERATIONAL


def test_autostart_goes_through_pre_operational() -> None:
    plant = Plant(autostart=True)
    plant.nmt.boot(0.0)
    assert plant.changes == [
        (NmtState.INITIALISING, NmtState.PRE_OPERATIONAL),
        (NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL),
    ]
    plant.command(130, 0)
    assert plant.nmt.state is NmtState.OPERATIONAL


def test_node_without_node_id_stays_silent_until_it_has_one() -> None:
    plant = Plant(UNCONFIGURED)
    plant.nmt.boot(0.0)
    for command in NmtCommand:
        plant.command(command, 0)
    assert (plant.nmt.state, plant.wire.take()) == (NmtState.INITIALISING, [])
    plant.node = 9
    plant.nmt.boot(1.0)
    assert plant.wire.take() == [Frame(0x709, b"\0")]


def test_cct_state_02_services_by_state() -> None:
    by_service = {service: {state for state in NmtState if service in ALLOWED[state]} for service in Service}
    running = {NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL}
    assert by_service == {
        Service.PDO: {NmtState.OPERATIONAL},
        Service.SDO: running,
        Service.SYNC: running,
        Service.TIME: running,
        Service.EMCY: running,
        Service.NODE_CONTROL: running | {NmtState.STOPPED},
        Service.ERROR_CONTROL: running | {NmtState.STOPPED},
        Service.LSS: {NmtState.INITIALISING, NmtState.STOPPED, NmtState.PRE_OPERATIONAL},
    }


def test_table_is_whole() -> None:
    """Every command is defined in every state that hears commands."""
    assert len(TRANSITIONS) == 3 * len(NmtCommand)
    assert NmtState.INITIALISING not in {state for state, _ in TRANSITIONS}


@given(st.lists(st.binary(max_size=8)))
def test_hostile_frames_never_leave_the_node_initialising(frames: list[bytes]) -> None:
    plant = Plant()
    plant.nmt.boot(0.0)
    for data in frames:
        plant.nmt.receive(Frame(0, data), 0.0)
        assert plant.nmt.state is not NmtState.INITIALISING
