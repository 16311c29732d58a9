"""Commands from standard input: one line in, one line out."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.rtde.enums import ProgramState
from gatewayd.simulator.control import Control
from gatewayd.simulator.faults import DropAt, FaultStep
from gatewayd.simulator.modes import SAFETY
from gatewayd.simulator.server import SimulatedController


@pytest.fixture
def control(simulator: SimulatedController) -> Control:
    return Control(simulator)


@pytest.mark.parametrize(
    "line,answer",
    [
        ("get robot_mode", "ok 7"),
        ("get payload_cog", "ok 0.0,0.0,0.06"),
        ("get output_bit_register_64", "ok false"),
        ("clients", "ok 0"),
        ("  drop-clients  ", "ok 0"),
        ("text hello there", "ok"),
        ("raw 00 03 52", "ok"),
        ("raw 0x52", "error '0x52' is not bytes as pairs of hexadecimal digits"),
        ("freeze on", "ok"),
        ("creep on", "ok"),
        ("delay 0.5", "ok"),
        ("delay -1", "error '-1' is not a number of seconds"),
        ("pause nan", "error 'nan' is not a number of seconds"),
        ("drop-at outputs:2", "ok"),
        ("drop-at off", "ok"),
        ("overwrite timestamp 1", "error timestamp follows the controller's cycles; use freeze to stop it"),
        ("silence off", "ok"),
        ("freeze maybe", "error on or off, not 'maybe'"),
        ("set timestamp 1", "error timestamp follows the controller's cycles; use freeze to stop it"),
        ("set output_int_register_0 2147483648", "error 2147483648 is not within -2147483648..2147483647"),
        ("set output_int_register_0 x", "error 'x' is not a number"),
        ("set payload_cog 1,x,2", "error 'x' is not a number"),
        ("delay soon", "error 'soon' is not a number"),
        ("set payload_cog 1", "error payload_cog takes 3 values, not 1"),
        ("get robot_mod", "error no field 'robot_mod'; did you mean robot_mode?"),
        ("hold", "error which field?"),
        ("hold nothing", "error no such input: nothing"),
        ("free input_int_register_0", "error input_int_register_0 is not held"),
        ("hold input_int_register_0,input_int_register_1 by hmi", "ok"),
        ("set robot_mode POWER_OFF", "ok"),
        (
            "set runtime_state PAUSE",
            f"error 'PAUSE' is neither a number nor one of {', '.join(ProgramState.__members__)}",
        ),
        ("power", "error '' is not one of on, off, release"),
        ("power brake", "error 'brake' is not one of on, off, release"),
        ("power on", "error the robot is RUNNING; it has to be POWER_OFF"),
        ("power off", "ok"),
        ("program pause", "ok"),
        ("program run", "error 'run' is not one of play, pause, stop"),
        ("safety protective-stop", "ok"),
        (
            "safety stop",
            f"error 'stop' is not one of {', '.join(SAFETY)}",
        ),
    ],
)
async def test_an_answer(control: Control, line: str, answer: str) -> None:
    assert await control.execute(line) == answer


@pytest.mark.parametrize(
    "field,value,shown",
    [
        ("output_int_register_0", "-5", "-5"),
        ("output_bit_registers0_to_31", "0xF0", "240"),
        ("output_bit_register_64", "true", "true"),
        ("output_double_register_0", "0.25", "0.25"),
        ("actual_q", "1, 2,3 ,4,5,6", "1.0,2.0,3.0,4.0,5.0,6.0"),
    ],
)
async def test_what_is_set_is_got(control: Control, field: str, value: str, shown: str) -> None:
    assert await control.execute(f"set {field} {value}") == "ok"
    assert await control.execute(f"get {field}") == f"ok {shown}"


async def test_hold_and_free_several(control: Control, simulator: SimulatedController) -> None:
    assert await control.execute("hold input_int_register_1,input_int_register_2") == "ok"
    assert simulator.controller.claims.owner("input_int_register_2") is not None
    assert await control.execute("free input_int_register_1, input_int_register_2") == "ok"
    assert simulator.controller.claims.owner("input_int_register_2") is None


async def test_switches(control: Control, simulator: SimulatedController) -> None:
    await control.execute("freeze on")
    assert (simulator.faults.freeze, simulator.faults.silence) == (True, False)


async def test_faults_of_lines_and_connections(control: Control, simulator: SimulatedController) -> None:
    for line in ("delay 0.25", "drop-at inputs:3", "creep on"):
        assert await control.execute(line) == "ok"
    faults = simulator.faults
    assert (faults.delay, faults.drop_at, faults.creep) == (0.25, DropAt(FaultStep.INPUTS, 3), True)
    answer = await control.execute("drop-at nowhere")
    assert answer.startswith(
        "error 'nowhere' is not STEP or STEP:NUMBER, where STEP is one of version, controller"
    )


async def test_what_is_overwritten_stays_until_it_is_switched_off(
    control: Control, simulator: SimulatedController
) -> None:
    controller = simulator.controller
    assert await control.execute("overwrite input_int_register_0 99") == "ok"
    controller.store.write("input_int_register_0", (5,))
    controller.advance()
    assert controller.get("input_int_register_0") == (99,)
    assert await control.execute("overwrite input_int_register_0 off") == "ok"
    controller.store.write("input_int_register_0", (5,))
    controller.advance()
    assert controller.get("input_int_register_0") == (5,)


async def test_an_unknown_command_names_the_known_ones(control: Control) -> None:
    answer = await control.execute("jump")
    assert answer.startswith("error unknown command 'jump'; there are: get, set, overwrite, hold")


@pytest.mark.parametrize("cycles", ["0", "-1", "x", "1.5", "10 20", "1000001"])
async def test_steps_are_counted_in_whole_cycles(cycles: str) -> None:
    answer = await Control(SimulatedController(stepped=True)).execute(f"step {cycles}")
    assert answer == f"error {cycles!r} is not a number of cycles within 1..1000000"


async def test_quit(control: Control) -> None:
    assert not control.quit
    assert await control.execute("quit") == "ok"
    assert control.quit


async def test_a_restart_is_answered_when_it_is_over(
    control: Control, simulator: SimulatedController
) -> None:
    simulator.set("output_int_register_0", 1)
    assert await control.execute("restart") == "ok"
    assert simulator.get("output_int_register_0") == 0


WORDS = st.sampled_from(
    ["get", "set", "hold", "free", "freeze", "text", "clients", "actual_q", "timestamp", "1", ","]
)


@given(st.one_of(st.text(max_size=40), st.lists(WORDS, max_size=4).map(" ".join)))
async def test_any_line_has_one_line_of_answer(line: str) -> None:
    answer = await Control(SimulatedController()).execute(line)
    assert answer.split(" ")[0] in ("ok", "error")
    assert len(answer.splitlines()) == 1


async def test_a_claim_names_its_holder(control: Control) -> None:
    await control.execute("hold input_int_register_0 by hmi")
    assert await control.execute("hold input_int_register_0") == "error input_int_register_0 is in use by hmi"
    assert await control.execute("free input_int_register_0") == "ok"
    assert await control.execute("hold input_int_register_0") == "ok"


async def test_a_state_has_a_name(control: Control) -> None:
    await control.execute("set joint_mode IDLE,IDLE,RUNNING,253,IDLE,IDLE")
    assert await control.execute("get joint_mode") == "ok 255,255,253,253,255,255"


async def test_a_protective_stop_is_one_command(control: Control, simulator: SimulatedController) -> None:
    await control.execute("safety protective-stop")
    simulator.controller.advance(500)
    assert await control.execute("get runtime_state") == "ok 4"
