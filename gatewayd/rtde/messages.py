"""The messages of RTDE as values, one class for each direction of each package type (guide, section "Protocol").

EE is the external executable (the client), CON the controller. A message knows nothing of bytes: `gatewayd.rtde.codec`
turns it into a package and back.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum

from gatewayd.rtde.fields import SoftwareVersion

NOT_FOUND = "NOT_FOUND"
"""In place of a type: the controller does not have the field."""
IN_USE = "IN_USE"
"""In place of an input's type: another client controls it."""
NOT_SET = "NOT_SET"
"""In place of a property's type: the controller knows it, and it has no value now."""
ERROR_WORDS = frozenset({NOT_FOUND, IN_USE})


class PackageType(IntEnum):
    """Third byte of every package."""

    REQUEST_PROTOCOL_VERSION = 86
    GET_URCONTROL_VERSION = 118
    TEXT_MESSAGE = 77
    DATA_PACKAGE = 85
    SETUP_OUTPUTS = 79
    SETUP_INPUTS = 73
    START = 83
    PAUSE = 80
    READ_PROPERTIES = 82
    """In no guide: UR's newest client libraries have it."""


class TextLevel(IntEnum):
    """Severity of a text message."""

    EXCEPTION = 0
    ERROR = 1
    WARNING = 2
    INFO = 3


@dataclass(frozen=True, slots=True)
class RequestProtocolVersion:
    """EE -> CON: speak this version from the reply on."""

    version: int


@dataclass(frozen=True, slots=True)
class ProtocolVersionReply:
    """CON -> EE."""

    accepted: bool


@dataclass(frozen=True, slots=True)
class GetControllerVersion:
    """EE -> CON."""


@dataclass(frozen=True, slots=True, order=True)
class ControllerVersion:
    """CON -> EE: the software of the controller. Ordered, so that versions compare."""

    major: int
    minor: int
    bugfix: int
    build: int

    def __str__(self) -> str:
        return f"{self.major}.{self.minor}.{self.bugfix}.{self.build}"

    @property
    def software(self) -> SoftwareVersion:
        """Without the build, as fields are listed by it."""
        return SoftwareVersion(self.major, self.minor, self.bugfix)


@dataclass(frozen=True, slots=True)
class TextMessage:
    """Both directions. Protocol v1 controllers send neither source nor a v2 level, only a message type."""

    message: str
    source: str
    level: int
    """A `TextLevel`, or whatever else the peer sent."""


@dataclass(frozen=True, slots=True)
class DataPackage:
    """Both directions: values of a recipe, still packed.

    `recipe` is None where the package carries no id (protocol v1, CON -> EE).
    """

    recipe: int | None
    payload: bytes


@dataclass(frozen=True, slots=True)
class SetupOutputs:
    """EE -> CON. `frequency` is None in protocol v1, which cannot choose one."""

    names: tuple[str, ...]
    frequency: float | None = None


@dataclass(frozen=True, slots=True)
class OutputsSetup:
    """CON -> EE: a type word or error word for each name. `recipe` is 0 if refused, None in protocol v1."""

    recipe: int | None
    types: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class SetupInputs:
    """EE -> CON."""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class InputsSetup:
    """CON -> EE: a type word or error word for each name; `recipe` counts from 1, 0 if refused."""

    recipe: int
    types: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Start:
    """EE -> CON."""


@dataclass(frozen=True, slots=True)
class StartReply:
    """CON -> EE."""

    accepted: bool


@dataclass(frozen=True, slots=True)
class Pause:
    """EE -> CON."""


@dataclass(frozen=True, slots=True)
class PauseReply:
    """CON -> EE."""

    accepted: bool


@dataclass(frozen=True, slots=True)
class ReadProperties:
    """EE -> CON: what the controller is made of. Software before 5.26 and 10.15 does not answer."""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class PropertiesReply:
    """CON -> EE: a type word, NOT_FOUND or NOT_SET for each name; values, packed, only if all are type words."""

    types: tuple[str, ...]
    payload: bytes


ExecutableMessage = (
    RequestProtocolVersion
    | GetControllerVersion
    | TextMessage
    | DataPackage
    | SetupOutputs
    | SetupInputs
    | Start
    | Pause
    | ReadProperties
)
"""What a client sends and a controller receives."""

ControllerMessage = (
    ProtocolVersionReply
    | ControllerVersion
    | TextMessage
    | DataPackage
    | OutputsSetup
    | InputsSetup
    | StartReply
    | PauseReply
    | PropertiesReply
)
"""What a controller sends and a client receives."""
ANSWER_TYPES: Mapping[type, PackageType] = {
    ProtocolVersionReply: PackageType.REQUEST_PROTOCOL_VERSION,
    ControllerVersion: PackageType.GET_URCONTROL_VERSION,
    OutputsSetup: PackageType.SETUP_OUTPUTS,
    InputsSetup: PackageType.SETUP_INPUTS,
    StartReply: PackageType.START,
    PauseReply: PackageType.PAUSE,
    PropertiesReply: PackageType.READ_PROPERTIES,
}
"""Answers of a controller -> type of their packages."""
