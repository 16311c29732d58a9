"""What can go wrong for a program that uses a robot. Every text says what to do, as far as that is known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from gatewayd.report.format import counted
from gatewayd.rtde.catalogue import suggest
from gatewayd.rtde.messages import NOT_FOUND

if TYPE_CHECKING:
    from gatewayd.rtde.loss import Loss
    from gatewayd.rtde.recipe import Scalar
    from gatewayd.rtde.session import Unavailable


class RtdeError(Exception):
    """Any failure of the API; ValueError and TypeError are kept for wrong arguments."""


class _LossError(RtdeError):
    def __init__(self, text: str, loss: Loss | None = None) -> None:
        super().__init__(text)
        self.loss = loss
        """The failure behind it; None where there was none."""


class ConnectFailedError(_LossError):
    """No session within the limits of `Retry`; `loss` is the last failure."""


class ConnectionLostError(_LossError):
    """There is no session (any more). Nothing that was pending is repeated: whether it arrived is not known."""


class FieldsRefusedError(RtdeError):
    """The controller does not give some of the wanted fields, and the robot was opened as `strict`."""

    def __init__(self, fields: Sequence[Unavailable]) -> None:
        self.fields = tuple(fields)
        """Each with the controller's word and what it means."""
        super().__init__("; ".join(map(_refusal, self.fields)))


class TypeDifference(NamedTuple):
    """A field whose type is not the declared one."""

    field: str
    declared: str
    answered: str


class TypesDifferError(RtdeError):
    """The controller has other types than were declared."""

    def __init__(self, differences: Sequence[TypeDifference]) -> None:
        self.differences = tuple(differences)
        """The fields in question."""
        super().__init__(
            "; ".join(
                f"{each.field} was declared as {each.declared}, the controller has {each.answered}"
                for each in self.differences
            )
        )


class WriteRefusedError(RtdeError):
    """A write that was not sent, as it was incomplete, would do nothing, or names what was not claimed."""

    def __init__(self, recipe: str, fields: Mapping[str, str]) -> None:
        self.recipe = recipe
        """The recipe that was to be written."""
        self.fields = dict(fields)
        """What is wrong, by field."""
        problems = "; ".join(f"{name}: {problem}" for name, problem in self.fields.items())
        super().__init__(f"nothing was sent by {recipe!r}: {problems}")


class NotVerifiedError(RtdeError):
    """A write that was sent, and that the controller's read-back did not show in time."""

    def __init__(self, seen: Mapping[str, tuple[object, object]], seconds: float) -> None:
        self.seen: Mapping[str, tuple[object, object]] = dict(seen)
        """Expected and seen value of each field that differs."""
        shown = "; ".join(f"{name} is {now}, not {wanted}" for name, (wanted, now) in self.seen.items())
        super().__init__(f"sent, but not shown by the robot within {seconds:g} s: {shown}")


def _refusal(field: Unavailable) -> str:
    near = suggest(field.field) if field.word == NOT_FOUND else ()
    meant = f"; did you mean {' or '.join(near)}?" if near and field.field not in near else ""
    return f"{field.field}: {field.word}, {field.hint}{meant}"


def wrong_count(name: str, given: Sequence[Scalar], count: int) -> str:
    """What to say of a value with another number of elements than its type has."""
    return f"{name} takes {counted(count, 'value')}, {len(given)} given"
