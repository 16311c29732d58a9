"""Writing to a robot: by named input recipes, and by helpers for what acts through masks."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from gatewayd.rtde.api.completion import Elements, complete, elements
from gatewayd.rtde.api.errors import ConnectionLostError, NotVerifiedError, WriteRefusedError
from gatewayd.rtde.api.feed import ConnectionState
from gatewayd.rtde.api.information import RobotInformation
from gatewayd.rtde.api.sample import Value
from gatewayd.rtde.api.verification import Expectation, expectations, failed, shown_by
from gatewayd.rtde.api.wanted import likely_input
from gatewayd.rtde.catalogue import bit_word
from gatewayd.rtde.claims import InputRecipe
from gatewayd.rtde.companions import COMPANIONS
from gatewayd.rtde.fields import BITS_PER_WORD
from gatewayd.rtde.recipe import Scalar

Values = Mapping[str, Value | Iterable[Scalar]]
"""Values by field."""

_PINS = {"standard": 8, "configurable": 8, "tool": 2}
_WORD_BITS = 2 * BITS_PER_WORD
_BITS = 128
_MILLIAMPERES, _VOLTS = (4.0, 20.0), (0.0, 10.0)
_THROUGH_MASK = frozenset(
    field for value, needs in COMPANIONS.items() for field in (value, needs.mask, needs.type) if field
)


class InputWriter(RobotInformation):
    """What a robot can be written. Only within a session: nothing waits for a connection, nothing is repeated."""

    async def write(
        self,
        recipe: str,
        values: Values | None = None,
        /,
        *,
        verify: bool = False,
        timeout: float = 1.0,  # noqa: ASYNC109  a public API in seconds
        **fields: Value | Iterable[Scalar],
    ) -> None:
        """Send values by the input recipe of that name, in one package: `write("in1", input_int_register_0=7)`.

        Registers of the recipe that are not given keep what they hold: what was sent last in this session, else what
        the robot reads back. A mask that is not given is 0. Where that is not enough nothing is sent. `verify`: return
        only when the robot shows the new values. It waits `timeout` seconds, also for a first package where what a
        register holds is needed.

        WriteRefusedError: nothing was sent, with the reason for each field; TypeError, ValueError: a value that does
        not fit its type; ConnectionLostError: no session, or lost meanwhile, and then it is not known whether the
        robot has it; NotVerifiedError. Guide, RTDE_DATA_PACKAGE and "Robot controller inputs".
        """
        asked = {**(values or {}), **fields}
        if not asked:
            message = "no value to write"
            raise ValueError(message)
        held = self._held(recipe)
        given = self._given(recipe, held, asked)
        await self._know(held, given, timeout)
        held = self._held(recipe)
        flat = complete(recipe, held.recipe, given, self._known)
        expected = self._expected(recipe, given) if verify else ()
        session = self._client.statistics.sessions
        if not self._client.send(held, flat):
            message = f"{recipe!r} was not sent: the connection is being lost"
            raise ConnectionLostError(message, self._feed.last_loss)
        slots = held.recipe.slots
        self._feed.written |= {name: flat[slots[name]] for name in slots if name not in _THROUGH_MASK}
        if verify:
            await self._verified(recipe, expected, session, timeout)

    def known(self, recipe: str) -> dict[str, Value]:
        """What the registers of an input recipe hold, as far as it is known: sent in this session, or read back."""
        found = {name: self._known(name) for name in self._held(recipe).recipe.names}
        return {
            name: value[0] if len(value) == 1 else value for name, value in found.items() if value is not None
        }

    async def set_standard_digital_outputs(
        self,
        values: Mapping[int, bool],
        *,
        verify: bool = False,
        timeout: float = 1.0,  # noqa: ASYNC109
    ) -> None:
        """Switch standard digital outputs 0 to 7, `{3: True}`; the others stay as they are.

        An input recipe has to have `standard_digital_output` and its mask. Errors as `write`.
        """
        await self._set_digital("standard", values, verify=verify, timeout=timeout)

    async def set_configurable_digital_outputs(
        self,
        values: Mapping[int, bool],
        *,
        verify: bool = False,
        timeout: float = 1.0,  # noqa: ASYNC109
    ) -> None:
        """Switch configurable digital outputs 0 to 7; as `set_standard_digital_outputs`."""
        await self._set_digital("configurable", values, verify=verify, timeout=timeout)

    async def set_tool_digital_outputs(
        self,
        values: Mapping[int, bool],
        *,
        verify: bool = False,
        timeout: float = 1.0,  # noqa: ASYNC109
    ) -> None:
        """Switch tool digital outputs 0 and 1 (inputs that are in no guide); as `set_standard_digital_outputs`."""
        await self._set_digital("tool", values, verify=verify, timeout=timeout)

    async def set_speed_slider(
        self,
        fraction: float,
        *,
        allow_zero: bool = False,
        verify: bool = False,
        timeout: float = 1.0,  # noqa: ASYNC109
    ) -> None:
        """Set the speed slider, 0 to 1. 0 stops the program's motion: only with `allow_zero`.

        An input recipe has to have `speed_slider_mask` and `speed_slider_fraction`. Errors as `write`.
        """
        if fraction == 0 and not allow_zero:
            message = "speed slider 0 stops the program's motion: say allow_zero=True if that is meant"
            raise ValueError(message)
        fields = {"speed_slider_mask": 1, "speed_slider_fraction": fraction}
        await self.write(self._recipe_with(fields), fields, verify=verify, timeout=timeout)

    async def set_analog_output(
        self,
        number: int,
        *,
        volts: float | None = None,
        milliamperes: float | None = None,
        verify: bool = False,
        timeout: float = 1.0,  # noqa: ASYNC109
    ) -> None:
        """Set analog output 0 or 1 to 0 to 10 V or 4 to 20 mA, and select that domain for it; the other one stays.

        An input recipe has to have `standard_analog_output_mask`, `standard_analog_output_type` and
        `standard_analog_output_0` or `_1`. Errors as `write`.
        """
        if number not in {0, 1}:
            message = f"analog output {number!r}: there are 0 and 1"
            raise ValueError(message)
        if (volts is None) == (milliamperes is None):
            message = "give either volts or milliamperes"
            raise ValueError(message)
        voltage = volts is not None
        ratio = (
            _share(volts, *_VOLTS, "V") if volts is not None else _share(milliamperes, *_MILLIAMPERES, "mA")
        )
        fields: dict[str, Value] = {
            "standard_analog_output_mask": 1 << number,
            "standard_analog_output_type": voltage << number,
            f"standard_analog_output_{number}": ratio,
        }
        await self.write(self._recipe_with(fields), fields, verify=verify, timeout=timeout)

    async def set_input_bits(
        self,
        values: Mapping[int, bool],
        *,
        verify: bool = False,
        timeout: float = 1.0,  # noqa: ASYNC109
    ) -> None:
        """Set general purpose input bits 0 to 127, `{5: True, 70: False}`; the others stay as they are.

        Bits 0 to 63 lie in the words `input_bit_registers0_to_31` and `32_to_63`, whose content has to be known.
        Fields of several recipes are sent one recipe after the other. Errors as `write`.
        """
        for number, value in values.items():
            if number not in range(_BITS) or not isinstance(value, bool):
                message = f"input bit {number!r}: {value!r}: bits are 0 to {_BITS - 1}, values True or False"
                raise ValueError(message)
        words: dict[str, dict[int, bool]] = {}
        fields: dict[str, Value] = {}
        for number, value in values.items():
            if number < _WORD_BITS:
                name, bit = bit_word("input", number)
                words.setdefault(name, {})[bit] = value
            else:
                fields[f"input_bit_register_{number}"] = value
        by_recipe: dict[str, dict[str, Value]] = {}
        for name in (*words, *fields):
            by_recipe.setdefault(self._recipe_with((name,)), {})[name] = fields.get(name, 0)
        for recipe, written in by_recipe.items():
            await self._know(self._held(recipe), {}, timeout)
            chosen = {name: self._word(recipe, name, words[name]) for name in written if name in words}
            await self.write(recipe, {**written, **chosen}, verify=verify, timeout=timeout)

    def _word(self, recipe: str, name: str, bits: Mapping[int, bool]) -> int:
        known = self._known(name)
        if known is None:
            raise WriteRefusedError(
                recipe, {name: "what its other bits hold is not known: write the whole word"}
            )
        chosen = sum(1 << bit for bit in bits)
        return int(known[0]) & ~chosen | sum(1 << bit for bit, value in bits.items() if value)

    async def _set_digital(
        self,
        kind: str,
        values: Mapping[int, bool],
        *,
        verify: bool,
        timeout: float,  # noqa: ASYNC109
    ) -> None:
        pins = range(_PINS[kind])
        for number, value in values.items():
            if number not in pins or not isinstance(value, bool):
                message = f"{kind} digital output {number!r}: {value!r}: pins are 0 to {pins[-1]}, values True or False"
                raise ValueError(message)
        if not values:
            message = "no output to switch"
            raise ValueError(message)
        fields = {
            f"{kind}_digital_output_mask": sum(1 << number for number in values),
            f"{kind}_digital_output": sum(1 << number for number, value in values.items() if value),
        }
        await self.write(self._recipe_with(fields), fields, verify=verify, timeout=timeout)

    # within

    def _held(self, recipe: str) -> InputRecipe:
        session = self._session()
        held = session.inputs.get(recipe)
        if held is not None:
            return held
        wanted = self._feed.wanted.inputs
        if recipe not in wanted:
            names = ", ".join(map(repr, wanted)) or "none"
            message = f"no input recipe is called {recipe!r}; there are: {names}"
            raise ValueError(message)
        raise WriteRefusedError(recipe, {name: self._refusal(name) for name in wanted[recipe]})

    def _recipe_with(self, fields: Iterable[str]) -> str:
        """The first wanted recipe that has all these fields."""
        names = tuple(fields)
        wanted = self._feed.wanted.inputs
        found = next((key for key, held in wanted.items() if set(names) <= set(held)), None)
        if found is None:
            message = f"no input recipe has {' and '.join(names)}: name them in `inputs`"
            raise ValueError(message)
        return found

    def _refusal(self, name: str) -> str:
        """Why a field is not claimed."""
        for each in self._session().unavailable:
            if each.field == name and not each.output:
                return f"{each.word}, {each.hint}"
        return f"is no field of the recipe{likely_input(name)}"

    def _given(self, recipe: str, held: InputRecipe, asked: Values) -> dict[str, Elements]:
        kinds = held.recipe.kinds
        absent = {name: self._refusal(name) for name in asked if name not in kinds}
        if absent:
            raise WriteRefusedError(recipe, absent)
        return {name: elements(name, value, kinds[name]) for name, value in asked.items()}

    def _known(self, name: str) -> Elements | None:
        """What a claimed input holds: sent by us, read right after it was claimed, or read back; else None."""
        sent = self._feed.written.get(name)
        if sent is not None:
            return sent
        session, reading = self._session(), self._feed.reading
        if name in session.unread:
            return None
        if name in session.held:
            return session.held[name]
        if reading is None or name not in reading:
            return None
        value = reading[name]
        return value if isinstance(value, tuple) else (value,)

    async def _know(self, held: InputRecipe, given: Mapping[str, Elements], timeout: float) -> None:  # noqa: ASYNC109
        """Wait for the first package of the session where it is needed to know what registers hold."""
        feed, session = self._feed, self._session()
        if feed.reading is not None or feed.state is not ConnectionState.RUNNING:
            return
        readable = session.outputs.kinds.keys() - session.unread
        if any(
            name not in given and name in readable and self._known(name) is None for name in held.recipe.names
        ):
            try:
                await feed.until(lambda: feed.reading, timeout)
            except TimeoutError:
                return  # what is missing is named by the refusal

    def _expected(self, recipe: str, given: Mapping[str, Elements]) -> tuple[Expectation, ...]:
        """What has to be seen; WriteRefusedError where it cannot be."""
        outputs = self._session().outputs.kinds
        problems = {
            name: "cannot be verified: the robot does not show it"
            for name in given
            if not name.endswith(("_mask", "_type")) and not shown_by(name)
        }
        problems |= {
            name: f"cannot be verified: {output} is not among the outputs"
            for name in given
            for output in shown_by(name)
            if output not in outputs
        }
        if self._feed.state is not ConnectionState.RUNNING:
            problems = dict.fromkeys(given, "cannot be verified while the output is paused")
        if problems:
            raise WriteRefusedError(recipe, problems)
        return tuple(expectations(given))

    async def _verified(
        self,
        recipe: str,
        expected: tuple[Expectation, ...],
        session: int,
        timeout: float,  # noqa: ASYNC109
    ) -> None:
        feed, since = self._feed, self._feed.samples

        def shown() -> bool | None:
            if feed.session is None or self._client.statistics.sessions != session:
                message = (
                    f"the connection was lost before {recipe!r} was verified; whether the robot has it is not known, "
                    "and it is not repeated"
                )
                raise ConnectionLostError(message, feed.last_loss)
            return True if feed.samples > since and not failed(expected, feed.latest) else None

        try:
            await feed.until(shown, timeout)
        except TimeoutError:
            raise NotVerifiedError(failed(expected, feed.latest), timeout) from None


def _share(value: float | None, low: float, high: float, unit: str) -> float:
    if value is None or isinstance(value, bool) or not (math.isfinite(value) and low <= value <= high):
        message = f"an analog output takes {low:g} to {high:g} {unit}, not {value!r}"
        raise ValueError(message)
    return (value - low) / (high - low)
