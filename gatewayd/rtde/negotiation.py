"""The client's part of an RTDE conversation as a table: which message comes next after which answer.

Pure: messages in, messages out. The order is version 2 (else 1), controller version, claims, readings, working recipe,
start. Where the working recipe reads every input back it is agreed before the claims, as nothing needs to be read
apart then: its first package after the claims is the reading. Whether a controller takes so long a list of outputs
only its answer shows; a refusal that blames no field leads to readings in pieces on the same connection. A reading is
an output recipe for one package: set up, started, paused. Inputs that are claimed later are read in the same way.

Text messages are the caller's; data packages are handed to the negotiation only while it waits for a start, which
they prove (a controller may send data before the answer to a start, or instead of it), or for the package of a reading.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import ClassVar

from gatewayd.report.format import counted
from gatewayd.rtde import messages
from gatewayd.rtde.catalogue import is_long
from gatewayd.rtde.claims import REFUSED, Claims, HandshakeError, sort_types
from gatewayd.rtde.fields import Series
from gatewayd.rtde.rates import V1_RATE, max_frequency, package_interval, requested_frequency
from gatewayd.rtde.reading import Reading
from gatewayd.rtde.recipe import Recipe
from gatewayd.rtde.session import TOO_LONG, Session, Unavailable, Wishes, without_inputs, without_outputs
from gatewayd.rtde.steps import NextStep, Notice, State

_ASKED_AGAIN = 3
"""Times in a row that what the session has had before is asked for again after a wrong answer."""
_NOTHING = NextStep()
_AT_REST = frozenset({State.RUNNING, State.PAUSED})
_BEFORE_PROBES = frozenset({State.NEW, State.VERSION, State.VERSION_2, State.VERSION_1, State.CONTROLLER})


class Negotiation:
    """One conversation. `begin` once, then `handle` for every answer. HandshakeError when it cannot go on."""

    def __init__(self, wishes: Wishes) -> None:
        self.state = State.NEW
        """What is awaited."""
        self.claims = Claims(
            wishes.inputs,
            wishes.watchdog,
            limited=wishes.limited,
            recipes=wishes.recipes,
            on_request=wishes.claim_on_request,
        )
        """The inputs."""
        self.controller: messages.ControllerVersion | None = None
        """The controller's software, once it is known."""
        self.took_long_list = False
        """Whether the controller has accepted a list longer than every controller takes."""
        self._wishes = wishes
        self._reading = Reading(wishes)
        self._run = wishes.running
        self._version = 1
        self._asked: tuple[str, ...] = ()
        self.outputs_id: int | None = None
        """The recipe id of data packages, as the controller last gave it; None in version 1."""
        self._outputs: Recipe | None = None
        """The working recipe while the controller has it."""
        self._agreed: Recipe | None = None
        """The working recipe of the session."""
        self._reported = False
        self._changing = False
        self._in_vain = 0
        """Wrong answers in a row to what the session has had before."""
        self._joined: frozenset[str] = frozenset()
        """Unread registers whose content is known all the same: they have been written."""
        self._probes = 0
        self._period = 1 / V1_RATE

    @property
    def running(self) -> bool:
        """Whether data is due."""
        return self.state is State.RUNNING

    @property
    def reading(self) -> bool:
        """Whether a package is due that is a reading."""
        return self.state is State.READING

    @property
    def delivering(self) -> bool:
        """Whether a data package that comes now is one of the working recipe."""
        state = self.state
        return state is State.RUNNING or state is State.PAUSING  # asked for each package: a set would hash

    @property
    def waiting(self) -> bool:
        """Whether an answer is due."""
        return self.state not in _AT_REST or self.claims.busy

    @property
    def awaited(self) -> str:
        """The answer that is due, in words."""
        claiming = self.state in _AT_REST and self.claims.asked
        return (State.INPUTS if claiming else self.state).value

    @property
    def awaits_long_list(self) -> bool:
        """Whether the answer that is due is that to a list which an old controller may refuse for its length."""
        return is_long(self._asked if self.state is State.OUTPUTS else self.claims.asked)

    def begin(self) -> messages.ExecutableMessage:
        """The first message."""
        forced = self._wishes.protocol
        self.state = State.VERSION_2 if forced is None else State.VERSION
        return messages.RequestProtocolVersion(forced or 2)

    def handle(self, message: messages.ControllerMessage) -> NextStep:
        """Take an answer; one that nobody awaits, and a data package out of season, change nothing."""
        action = self._TABLE.get((self.state, type(message)))
        if action is not None:
            return action(self, message)
        if isinstance(message, messages.DataPackage):
            return _NOTHING
        return self._misplaced(message)

    def retry_claims(self) -> messages.ExecutableMessage | None:
        """Ask again for inputs that were in use, if any are and no answer is due."""
        if self.waiting:
            return None
        self.claims.retry()
        return self.claims.request()

    def join(self, fields: Iterable[str]) -> messages.ExecutableMessage | None:
        """Have unread registers share a recipe with the others: at once, or when no answer is due (then None)."""
        joining = frozenset(fields)
        self._joined |= joining
        self.claims.join(joining)
        return None if self.waiting else self.claims.request()

    def probe(self) -> messages.ExecutableMessage | None:
        """Ask for an answer that comes behind everything the controller sent before; `Notice.PROBED` when it is there.

        None before the session is complete. An answer that is still due to an earlier probe is waited for first.
        """
        if not self._reported:
            return None
        self._probes += 1
        return messages.GetControllerVersion()

    def pause(self) -> messages.ExecutableMessage | None:
        """Stop the output: at once, or as soon as the negotiation gets there (then None)."""
        self._run = False
        if self.state is not State.RUNNING:
            return None
        self.state = State.PAUSING
        return messages.Pause()

    def resume(self) -> messages.ExecutableMessage | None:
        """Start the output again: at once, or as soon as the negotiation gets there (then None)."""
        self._run = True
        if self.state is not State.PAUSED:
            return None
        self.state = State.RESUMING
        return messages.Start()

    def session(self, round_trip: float = 0.0) -> Session:
        """What has been agreed. Only after `Notice.STARTED`."""
        assert self.controller is not None
        assert self._agreed is not None
        unread = self._reading.unread(self.claims.types)
        return Session(
            self.controller,
            Series.from_major(self.controller.major),
            self._version,
            self._period,
            self._agreed,
            self.claims.recipes,
            self._unavailable(),
            {name: values for name, values in self._reading.held.items() if name not in unread},
            unread,
            round_trip,
            float(V1_RATE if self._version == 1 else max_frequency(self.controller)),
            self.outputs_id,
        )

    def change(self, wishes: Wishes) -> NextStep:
        """Set up what `wishes` has in place of what there is; only while paused and not `waiting`.

        `Notice.CHANGED` when it is done. Of the inputs only `Wishes.recipes` are changed: those that stay as they were
        keep their ids, what is no longer wanted stays claimed until the connection ends. HandshakeError as in `handle`.
        """
        limited = self._reading.limited
        self._wishes = wishes
        self._reading = Reading(wishes, limited=limited)
        self._outputs = self._agreed = None
        self._in_vain = 0
        self._changing = True
        self.claims.change(wishes.recipes)
        return self._set_out()

    # the way to the session

    def _version_answered(self, reply: messages.ProtocolVersionReply) -> NextStep:
        forced = self._wishes.protocol
        assert forced is not None
        if not reply.accepted:
            message = f"the controller does not speak protocol version {forced}, which was forced"
            raise HandshakeError(message)
        self._version = forced
        return self._go(State.CONTROLLER, messages.GetControllerVersion())

    def _version_2_answered(self, reply: messages.ProtocolVersionReply) -> NextStep:
        if reply.accepted:
            self._version = 2
            return self._go(State.CONTROLLER, messages.GetControllerVersion())
        return self._go(State.VERSION_1, messages.RequestProtocolVersion(1))

    def _version_1_answered(self, reply: messages.ProtocolVersionReply) -> NextStep:
        if not reply.accepted:
            raise HandshakeError("the controller speaks neither protocol version 2 nor 1")
        return self._go(State.CONTROLLER, messages.GetControllerVersion())

    def _controller_answered(self, version: messages.ControllerVersion) -> NextStep:
        self.controller = version
        return self._set_out()

    def _set_out(self) -> NextStep:
        """The first thing to do for what is wanted."""
        if self._wishes.read_back and not self._reading.limited:
            return self._ask_outputs()
        return self._advance()

    def _advance(self, event: Notice | None = None) -> NextStep:
        """The next thing to do while no output runs: claim, read, set up the working recipe, start it."""
        request = self._claim()
        if request is not None:
            return self._go(State.INPUTS, request, event)
        piece = self._reading.piece(self.claims.types)
        if piece:
            self._outputs = None
            return self._set_up(State.READING_SETUP, piece, event)
        if self._outputs is None:
            return self._ask_outputs(event)
        self.claims.take_change()
        if self._run:
            return self._go(State.STARTING, messages.Start(), event)
        return self._go(State.PAUSED, None, self._complete())

    def _claim(self) -> messages.ExecutableMessage | None:
        """The next request for inputs; registers that turned out not to be readable go apart."""
        request = self.claims.request()
        if request is None and not self.claims.busy and self._is_read():
            self.claims.separate(self._reading.unread(self.claims.types) - self._apart() - self._joined)
            request = self.claims.request()
        return request

    def _is_read(self) -> bool:
        """Whether it is known of every claimed input if it can be read."""
        return self._outputs is not None and not self._reading.piece(self.claims.types)

    def _apart(self) -> frozenset[str]:
        """Fields that have a recipe of their own."""
        return frozenset(key for key, held in self.claims.recipes.items() if held.recipe.names == (key,))

    def _ask_outputs(self, event: Notice | None = None) -> NextStep:
        names = self._agreed.names if self._agreed is not None else self._reading.working()
        if not names:
            raise HandshakeError("the controller offers none of the wanted outputs")
        return self._set_up(State.OUTPUTS, names, event)

    def _set_up(self, state: State, names: tuple[str, ...], event: Notice | None) -> NextStep:
        self._asked = names
        return self._go(state, messages.SetupOutputs(names, self._frequency()), event)

    def _frequency(self) -> float | None:
        """What to ask for; None in protocol version 1, which cannot choose."""
        assert self.controller is not None
        if self._version == 1:
            return None
        frequency = requested_frequency(self._wishes.frequency, self.controller)
        self._period = package_interval(frequency, self.controller)
        return frequency

    def _outputs_answered(self, reply: messages.OutputsSetup) -> NextStep:
        names = self._asked
        if self._agreed is not None and (
            reply.recipe == 0 or reply.types != tuple(each.word for each in self._agreed.types)
        ):
            return self._ask_again("the same output recipe answered differently than before")
        if reply.recipe == 0 and messages.NOT_FOUND not in reply.types and is_long(names):
            return self._list_refused()
        types, refused = sort_types(names, reply.types)
        if refused:
            self._reading.refused |= refused
            return self._ask_outputs()
        if reply.recipe == 0:
            raise HandshakeError("the controller refused the output recipe without naming a field")
        self.took_long_list |= is_long(names)
        self.outputs_id = reply.recipe
        self._outputs = self._agreed or Recipe(names, types)
        self._reading.agree(self._outputs)
        if self._agreed is None:
            self.claims.separate(name for name in self._reading.refused if name.startswith("input_"))
        return self._advance()

    def _ask_again(self, wrong: str) -> NextStep:
        """A wrong answer to what the session has had before costs no session: it is asked for again.

        Only a controller that goes on so has nothing more to give by this session, which needs its values.
        """
        self._in_vain += 1
        if self._in_vain > _ASKED_AGAIN:
            raise HandshakeError(f"{wrong}, {self._in_vain} times in a row")
        resuming = self.state is State.RESUMING
        step = self._go(self.state, messages.Start()) if resuming else self._advance()
        return step._replace(strange=wrong)

    def _list_refused(self) -> NextStep:
        self._reading.limited = True
        self.claims.limit()
        return self._advance()

    def _inputs_answered(self, reply: messages.InputsSetup) -> NextStep:
        strange = self._take_claim(reply)
        return self._advance()._replace(strange=strange)

    def _started(self, message: messages.StartReply | messages.DataPackage) -> NextStep:
        if isinstance(message, messages.DataPackage):
            assert self._outputs is not None
            if not self._is_of(message, self._outputs):
                return _NOTHING
        elif not message.accepted:
            return self._start_refused()
        self._in_vain = 0
        event = Notice.RESUMED if self.state is State.RESUMING else self._complete()
        if not self._run:
            return self._go(State.PAUSING, messages.Pause(), event)
        return self._rest(State.RUNNING, event)

    def _start_refused(self) -> NextStep:
        """In version 1 the answer to a list has no place for a refusal: it shows here."""
        if self._agreed is not None:
            return self._ask_again("a refused start of the output")
        if self._outputs is None or not is_long(self._outputs.names):
            raise HandshakeError("the controller refused to start the output")
        self._outputs = None
        self.took_long_list = False
        return self._list_refused()

    def _complete(self) -> Notice:
        """The working recipe is set up and, if wanted, started: what that is to the user."""
        self._agreed = self._outputs
        event = Notice.INPUTS_CHANGED if self._reported else Notice.STARTED
        event, self._changing = (Notice.CHANGED if self._changing else event), False
        self._reported = True
        return event

    # readings

    def _piece_answered(self, reply: messages.OutputsSetup) -> NextStep:
        if len(reply.types) != len(self._asked):
            return self._give_up_piece(
                f"{counted(len(reply.types), 'type')} for {counted(len(self._asked), 'field')} of a reading"
            )
        types, refused = sort_types(self._asked, reply.types)
        if refused:
            self._reading.refused |= refused
            return self._advance()
        if reply.recipe == 0:
            return self._give_up_piece("a refused reading without a word for any field")
        self.outputs_id = reply.recipe
        self._reading.expect(Recipe(self._asked, types))
        return self._go(State.READING_START, messages.Start())

    def _give_up_piece(self, strange: str) -> NextStep:
        """The fields of the piece stay unread, in recipes of their own until they are given; that costs no session."""
        self._reading.refused |= dict.fromkeys(self._asked, REFUSED)
        return self._advance()._replace(strange=strange)

    def _reading_started(self, message: messages.StartReply | messages.DataPackage) -> NextStep:
        """A package before the answer proves the start; the reading is the next, which surely is of this piece."""
        if isinstance(message, messages.StartReply) and not message.accepted:
            return self._give_up_piece("a refused start of a reading")
        return self._go(State.READING, None)

    def _read(self, package: messages.DataPackage) -> NextStep:
        if package.recipe != self.outputs_id or not self._reading.take(package.payload):
            return _NOTHING
        return self._go(State.READING_PAUSE, messages.Pause())

    def _reading_paused(self, _: messages.PauseReply) -> NextStep:
        return self._advance()

    # while there is a session

    def _more_inputs_answered(self, reply: messages.InputsSetup) -> NextStep:
        if not self.claims.asked:
            return self._misplaced(reply)
        strange = self._take_claim(reply)
        return self._settle()._replace(strange=strange)

    def _settle(self, event: Notice | None = None) -> NextStep:
        """Go on with claims; when there are no more, read what is new, or report the change."""
        if self.claims.busy:
            return NextStep(self.claims.request(), event)
        request = self._claim()
        if request is not None:
            return NextStep(request, event)
        if not self._reading.piece(self.claims.types):
            changed = event is None and self.claims.take_change()
            return NextStep(None, Notice.INPUTS_CHANGED if changed else event)
        if self.state is State.RUNNING:
            return self._go(State.READING_PAUSE, messages.Pause(), event)
        return self._advance(event) if self.state is State.PAUSED else NextStep(None, event)

    def _rest(self, state: State, event: Notice) -> NextStep:
        """Nothing is due but what has come up meanwhile."""
        self.state = state
        return self._settle(event)

    def _started_late(self, message: messages.StartReply) -> NextStep:
        """The answer to a start that data had proved already."""
        if not message.accepted:
            return NextStep(strange="a refused start of the output that runs", taken=False)
        return _NOTHING

    def _paused(self, _: messages.PauseReply) -> NextStep:
        if self._run:
            return self._go(State.RESUMING, messages.Start(), Notice.PAUSED)
        return self._rest(State.PAUSED, Notice.PAUSED)

    def _probed(self, version: messages.ControllerVersion) -> NextStep:
        if not self._probes:
            return self._misplaced(version)
        self._probes -= 1
        return _NOTHING if self._probes else NextStep(None, Notice.PROBED)

    def _take_claim(self, reply: messages.InputsSetup) -> str:
        """Take the answer; returns what is odd about it."""
        asked = self.claims.asked
        self.claims.answer(reply)
        self.took_long_list |= bool(reply.recipe) and is_long(asked)
        given = len(reply.types)
        return f"{counted(given, 'type')} for {counted(len(asked), 'input')}" if given != len(asked) else ""

    def _go(
        self, state: State, send: messages.ExecutableMessage | None, event: Notice | None = None
    ) -> NextStep:
        self.state = state
        return NextStep(send, event)

    def _misplaced(self, message: messages.ControllerMessage) -> NextStep:
        return NextStep(strange=f"{type(message).__name__} while {self.awaited} was awaited", taken=False)

    def _is_of(self, package: messages.DataPackage, recipe: Recipe) -> bool:
        return package.recipe == self.outputs_id and len(package.payload) == recipe.size

    def _unavailable(self) -> tuple[Unavailable, ...]:
        assert self.controller is not None
        outputs = self._reading.refused | dict.fromkeys(self._reading.left_out, TOO_LONG)
        missing = without_outputs(outputs, self._wishes.read_backs())
        return (*missing, *without_inputs(self.claims.refused, self.controller.software))

    _TABLE: ClassVar[Mapping[tuple[State, type], Callable[..., NextStep]]] = {
        (State.VERSION, messages.ProtocolVersionReply): _version_answered,
        (State.VERSION_2, messages.ProtocolVersionReply): _version_2_answered,
        (State.VERSION_1, messages.ProtocolVersionReply): _version_1_answered,
        (State.CONTROLLER, messages.ControllerVersion): _controller_answered,
        (State.INPUTS, messages.InputsSetup): _inputs_answered,
        (State.READING_SETUP, messages.OutputsSetup): _piece_answered,
        (State.READING_START, messages.StartReply): _reading_started,
        (State.READING_START, messages.DataPackage): _reading_started,
        (State.READING, messages.StartReply): _started_late,
        (State.READING, messages.DataPackage): _read,
        (State.READING_PAUSE, messages.StartReply): _started_late,
        (State.READING_PAUSE, messages.PauseReply): _reading_paused,
        (State.OUTPUTS, messages.OutputsSetup): _outputs_answered,
        (State.STARTING, messages.StartReply): _started,
        (State.STARTING, messages.DataPackage): _started,
        (State.RUNNING, messages.StartReply): _started_late,
        (State.RUNNING, messages.InputsSetup): _more_inputs_answered,
        (State.PAUSING, messages.StartReply): _started_late,
        (State.PAUSING, messages.InputsSetup): _more_inputs_answered,
        (State.PAUSING, messages.PauseReply): _paused,
        (State.PAUSED, messages.InputsSetup): _more_inputs_answered,
        (State.RESUMING, messages.StartReply): _started,
        (State.RESUMING, messages.DataPackage): _started,
        (State.RESUMING, messages.InputsSetup): _more_inputs_answered,
        **dict.fromkeys(
            ((state, messages.ControllerVersion) for state in State if state not in _BEFORE_PROBES), _probed
        ),
    }
    """State and kind of answer -> what to do with it; everything else is out of place."""
