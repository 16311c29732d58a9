"""The mapping that the tests of the status listener stand on, and the indices of what is in it."""

from __future__ import annotations

import time
from pathlib import Path

from gatewayd.control.access import Role
from gatewayd.control.tokens import Token, TokenSet, as_text, digest_of

TOKEN = "test-token-0123456789"  # noqa: S105 - for tests
PLC, HMI, LINE = range(3)
START, FORCE_LIMIT, SPARE, CYCLES = range(4)
MAPPING = """\
gatewayd: 1
cell: press
robot: {host: 127.0.0.1, port: 30004}
modbus: {listen: '127.0.0.1:15020', unit: 1}
writers:
  plc: {modbus: 127.0.0.2, timeout: 1s}
  hmi: {modbus: 127.0.0.3}
  line: {modbus: 127.0.0.4}
variables:
  start:       {robot: input_bit_register_0, modbus: 0.3, owner: plc, comment: begin one cycle}
  force_limit: {robot: input_double_register_0, modbus: {holding: 20, type: int16, scale: 0.1},
                owner: [plc, hmi], lease: 5s, limits: [0, 150], unit: N}
  spare:       {robot: input_int_register_0, modbus: 30, owner: line}
  cycles:      {robot: output_int_register_0, modbus: [110, {input: 8}], on_stale: hold}
  tcp:         {robot: actual_TCP_pose, modbus: {holding: 130, type: float32}, unit: m}
"""


def token(name: str, role: Role, text: str, seconds: float = 3600.0) -> Token:
    """A token whose text a test knows."""
    now = float(int(time.time()))
    return Token(name, role, digest_of(text), now, now + seconds)


def write_tokens(path: Path, *tokens: Token) -> Path:
    """A file of these tokens."""
    path.write_text(as_text(TokenSet(tokens)))
    path.chmod(0o600)
    return path


def engineer(path: Path) -> Path:
    """A file with anna's token, `TOKEN`, who may do everything."""
    return write_tokens(path, token("anna", Role.ENGINEER, TOKEN))
