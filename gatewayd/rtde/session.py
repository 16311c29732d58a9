"""What a client wants of a controller, and what was agreed with it. Records; the way there is in the negotiation."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

from gatewayd.report.format import address
from gatewayd.rtde.catalogue import likely_holders
from gatewayd.rtde.claims import REFUSED, UNASKED, InputRecipe
from gatewayd.rtde.fields import OUTPUTS, Series, SoftwareVersion
from gatewayd.rtde.messages import IN_USE, NOT_FOUND, ControllerVersion
from gatewayd.rtde.recipe import Recipe, Scalar
from gatewayd.rtde.types import DEFAULT_PORT

TIMESTAMP = "timestamp"
"""The output that is always subscribed, first: it shows skipped and late packages, and a restarted controller."""
TOO_LONG = "TOO_LONG"
"""Our word for an output that was left out because the controller does not take so long a list of names."""


@dataclass(frozen=True, slots=True)
class Wishes:
    """What a client wants of a controller."""

    outputs: tuple[str, ...] = ()
    """Fields to subscribe; `timestamp` is put first by itself."""
    inputs: tuple[str, ...] = ()
    """Fields to claim."""
    recipes: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Input recipes by name, each claimed and sent by itself, besides those that are made of `inputs`."""
    watchdog: str | None = None
    """Input field that gets a recipe of its own, so that nothing else feeds it; need not be in `inputs`."""
    frequency: float = 0.0
    """Packages per second; 0: the controller's own rate. The controller divides its rate by a whole number."""
    read_back: bool = True
    """Subscribe the claimed `input_*` fields too, after the outputs, as far as the controller takes so long a list.

    Else they are read right after they were claimed and not again.
    """
    claim_on_request: bool = False
    """Claim nothing before `RtdeClient.claim` asks for it: another client may have the inputs, and is to keep them."""
    limited: bool = False
    """Send no list of names of more than `OLD_LIST_LIMIT` bytes: the controller does not take it."""
    running: bool = True
    """Start the output; else stay paused."""
    protocol: int | None = None
    """The protocol version to speak; None: 2, or 1 where the controller refuses it."""

    def wanted_inputs(self) -> tuple[str, ...]:
        """Fields to claim, the watchdog included."""
        named = (name for names in self.recipes.values() for name in names)
        return tuple(dict.fromkeys((*self.inputs, *named, *((self.watchdog,) if self.watchdog else ()))))

    def wanted_outputs(self) -> tuple[str, ...]:
        """Fields to subscribe whatever becomes of the inputs."""
        return tuple(dict.fromkeys((TIMESTAMP, *self.outputs)))

    def read_backs(self) -> tuple[str, ...]:
        """Inputs that the controller also offers as outputs and that are not subscribed anyway."""
        return tuple(
            name
            for name in self.wanted_inputs()
            if name.startswith("input_") and name in OUTPUTS and name not in self.outputs
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class ClientSettings(Wishes):
    """Where the controller is, what is wanted of it, and how long to wait. Times in seconds."""

    host: str
    """Name or address."""
    port: int = DEFAULT_PORT
    connect_timeout: float = 2.0
    handshake_timeout: float = 2.0
    """For each answer of the set-up."""
    data_timeout: float = 1.0
    """Without a package while the output runs, five periods at least: the connection is taken for dead."""
    first_data_timeout: float = 30.0
    """The same before the first package: a controller whose safety set-up is unconfirmed sends none for a while."""
    claim_retry: float = 1.0
    """Between attempts to claim inputs that are in use; the first ones come quicker."""
    backoff: float = 0.05
    """Before the first new connection; doubles with each failure."""
    backoff_limit: float = 2.0
    """Longest wait before a new connection."""
    every: bool = False
    """Hand on every package; else only the newest of a long burst."""
    write_buffer: int = 65536
    """Unsent bytes at which a controller that does not read is given up."""

    @property
    def address(self) -> str:
        """Host and port for reading."""
        return address(self.host, self.port)


@dataclass(frozen=True, slots=True)
class Unavailable:
    """A field that the controller does not give."""

    field: str
    output: bool
    """Wanted as output, or to read an input back; else as input."""
    word: str
    """The controller's word: NOT_FOUND, IN_USE, a type unknown to us; or REFUSED, TOO_LONG."""
    hint: str
    """What it means, who may be behind it."""


@dataclass(frozen=True, slots=True)
class Session:
    """What was agreed with the controller. A new object whenever the inputs change.

    Every claimed field is in exactly one recipe of `inputs`. What it held when it was claimed is in `held`; else it is
    in `unread`; else the working recipe reads it back, and the first package after the session was reported shows it.
    """

    controller: ControllerVersion
    series: Series | None
    """None for a major software version that we do not know."""
    protocol: int
    """RTDE protocol version spoken."""
    period: float
    """Seconds between packages, as the controller divides its own rate."""
    outputs: Recipe
    """Layout of the values, the same for the whole session; `timestamp` is first unless the controller lacks it."""
    inputs: Mapping[str, InputRecipe]
    """Claimed inputs by recipe key (`gatewayd.rtde.claims.recipe_key`; an unread register has its own name)."""
    unavailable: tuple[Unavailable, ...]
    held: Mapping[str, tuple[Scalar, ...]] = field(default_factory=dict)
    """What inputs held that were read apart from the working recipe, right after they had been claimed, by field.

    For an input that an earlier session object had already it is as old as the claim.
    """
    unread: frozenset[str] = frozenset()
    """Claimed inputs of which the controller does not say what they hold.

    A register among them has a recipe of its own, until `RtdeClient.join` was called for it.
    """
    round_trip: float = 0.0
    """Longest time from a request to its answer so far, in seconds."""
    max_frequency: float = 0.0
    """Packages that the controller can send per second."""
    outputs_id: int | None = None
    """Recipe id of the outputs; None in protocol version 1."""


def output_hint(word: str, *, read_back: bool) -> str:
    """What the word for an output, or for the reading of an input, means."""
    if word == NOT_FOUND:
        return "this controller's software does not have the field"
    if word == REFUSED:
        return "the controller did not let it be read"
    if word != TOO_LONG:
        return f"the controller names a type that is not known here: {word}"
    if read_back:
        return "not verified: the controller does not take a list of outputs that has it too"
    return "left out because the controller does not take so long a list of outputs: map fewer of them"


def input_hint(name: str, word: str, software: SoftwareVersion | None = None) -> str:
    """What the word for an input means, on a controller with this software."""
    if word == IN_USE:
        return f"probably claimed by {likely_holders(name, software)}"
    if word == NOT_FOUND:
        return "this controller's software does not have the input"
    if word == UNASKED:
        return "it was not asked for yet"
    return f"the controller answered {word}"


def without_outputs(words: Mapping[str, str], read_backs: Collection[str]) -> list[Unavailable]:
    """The outputs with these words, of which `read_backs` are inputs that are read back."""
    return [
        Unavailable(name, True, word, output_hint(word, read_back=name in read_backs))
        for name, word in words.items()
    ]


def without_inputs(words: Mapping[str, str], software: SoftwareVersion) -> list[Unavailable]:
    """The inputs with these words, on a controller with this software."""
    return [Unavailable(name, False, word, input_hint(name, word, software)) for name, word in words.items()]
