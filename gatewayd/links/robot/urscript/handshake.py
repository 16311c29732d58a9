"""The robot's half of a handshake by two bits: data first, then a toggle, then the acknowledgement.

The sender writes its data, then changes the toggle bit. The receiver sees that toggle and acknowledgement
differ, takes the data, and makes the acknowledgement equal to the toggle. Then the sender may send again. Both bits are
in registers, so nothing is lost when a program restarts, and a change that nobody has seen stays visible.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from gatewayd.core.definition import ValueKind, Variable
from gatewayd.links.exports import ExportError
from gatewayd.links.robot.urscript.accessors import argument, reader
from gatewayd.links.robot.urscript.registers import ScriptRegister
from gatewayd.report.wording import did_you_mean


@dataclass(frozen=True, slots=True)
class Handshake:
    """Two bits: the sender's toggle and the receiver's acknowledgement, one in each direction."""

    toggle: ScriptRegister
    toggle_bit: Variable
    acknowledge: ScriptRegister
    acknowledge_bit: Variable

    @property
    def to_robot(self) -> bool:
        """Whether the robot receives."""
        return self.toggle.is_input

    @property
    def name(self) -> str:
        """What its functions are called by: the variable of the toggle."""
        return _function_name(self.toggle, self.toggle_bit)


def handshake(text: str, registers: Sequence[ScriptRegister]) -> Handshake:
    """`TOGGLE:ACKNOWLEDGE`, both names of the mapping. Raises ExportError where that is no handshake."""
    first, separator, second = text.partition(":")
    if not separator:
        raise ExportError(f"--handshake {text}: name two bits, TOGGLE:ACKNOWLEDGE")
    toggle, acknowledge = _bit(first, registers, text), _bit(second, registers, text)
    if toggle[0].is_input == acknowledge[0].is_input:
        way = "to" if toggle[0].is_input else "from"
        raise ExportError(
            f"--handshake {text}: both bits go {way} the robot; the acknowledgement goes the way that the data comes"
        )
    return Handshake(*toggle, *acknowledge)


def _bit(name: str, registers: Sequence[ScriptRegister], text: str) -> tuple[ScriptRegister, Variable]:
    known = {variable.name: (register, variable) for register in registers for variable in register.variables}
    if name not in known:
        hint = did_you_mean(name, known, "the bits of a handshake are registers of the robot program")
        raise ExportError(f"--handshake {text}: there is no `{name}` for a robot program: {hint}")
    if known[name][1].kind is not ValueKind.BOOL:
        raise ExportError(f"--handshake {text}: `{name}` is no bit")
    return known[name]


def _function_name(register: ScriptRegister, bit: Variable) -> str:
    index = argument(register, bit)
    return f"{register.name}_{index}" if index else register.name


def functions(pair: Handshake, prefix: str) -> Iterator[str]:
    """The functions of one handshake."""
    bits = _read(pair.toggle, pair.toggle_bit, prefix), _read(pair.acknowledge, pair.acknowledge_bit, prefix)
    yield from (_receiving if pair.to_robot else _sending)(pair, prefix, *bits)


def _receiving(pair: Handshake, prefix: str, toggle: str, acknowledge: str) -> Iterator[str]:
    name, bits = pair.name, f"{pair.toggle_bit.name} and {pair.acknowledge_bit.name}"
    yield from (
        "",
        f"# handshake to the robot by {bits}: the sender writes data, then changes {pair.toggle_bit.name}",
        f"def {prefix}_pending_{name}():",
        f"  return {toggle} != {acknowledge}",
        "end",
        "",
        "# waits for data; then read them, and acknowledge",
        f"def {prefix}_wait_{name}():",
        f"  while not {prefix}_pending_{name}():",
        "    sync()",
        "  end",
        "end",
        "",
        "# the data were taken: the sender may send again. At the start of a program: forget what came before it",
        f"def {prefix}_acknowledge_{name}():",
        f"  {_write(pair.acknowledge, pair.acknowledge_bit, toggle)}",
        "end",
    )


def _sending(pair: Handshake, prefix: str, toggle: str, acknowledge: str) -> Iterator[str]:
    name, bits = pair.name, f"{pair.toggle_bit.name} and {pair.acknowledge_bit.name}"
    yield from (
        "",
        f"# handshake from the robot by {bits}: whether the receiver has taken what was sent",
        f"def {prefix}_taken_{name}():",
        f"  return {toggle} == {acknowledge}",
        "end",
        "",
        "# after the data were written, in a later control cycle; False: the receiver has not taken what came before",
        f"def {prefix}_send_{name}():",
        f"  if not {prefix}_taken_{name}():",
        "    return False",
        "  end",
        "  sync()",
        f"  {_write(pair.toggle, pair.toggle_bit, f'not {toggle}')}",
        "  return True",
        "end",
    )


def _read(register: ScriptRegister, bit: Variable, prefix: str) -> str:
    """An expression that has the bit; of an output what the program wrote last."""
    if register.is_input:
        return f"{reader(register, prefix)}({argument(register, bit)})"
    return f"read_{register.register}({register.number + register.variables.index(bit)})"


def _write(register: ScriptRegister, bit: Variable, value: str) -> str:
    return f"write_{register.register}({register.number + register.variables.index(bit)}, {value})"
