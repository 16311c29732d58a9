"""The small languages inside a mapping: durations, names, networks, policies. Those of one kind of link
lie with it.

Each reader takes what YAML made of a value and gives a typed one. What cannot be read raises
`ValueRefused`, with the slug of the rule that it breaks, a message and the remedy.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import partial
from ipaddress import IPv4Address, IPv4Network, IPv6Address, IPv6Network, ip_address, ip_network
from typing import Annotated, Any, Final, Literal, NoReturn, TypeAlias

from gatewayd.core.definition import Fallback, FallbackKind, Value
from gatewayd.mapping import syntax
from gatewayd.mapping.diagnostics import Rule
from gatewayd.mapping.source import RealNumber, WholeNumber
from gatewayd.mapping.typed import AfterValidator, BeforeValidator, Field, InstanceOf, ValueRefused
from gatewayd.report.format import MAX_PORT, split_address
from gatewayd.report.format import address as address_text
from gatewayd.report.wording import did_you_mean

_DECIMAL = re.compile(r"-?(0|[1-9][0-9]*)(\.[0-9]+)?")
_NUMBER_LIKE = re.compile(r"[-+]?[0-9.][0-9a-fA-FxXoO_.,:+-]*")
_MEASURED = re.compile(
    r"(-?[0-9]{1,12}(?:\.[0-9]{1,12})?)[ ]?(?:([kKM])(?:bit(?:/s)?|bps|Bd|Hz)?|[A-Za-z%°][A-Za-z/%°]{0,9})"
)
_FACTORS: Final = {"k": 1000, "K": 1000, "M": 1_000_000}
_DURATION = re.compile(r"([0-9]+(?:\.[0-9]+)?)[ ]?(ms|s|min|h)")
_SECONDS: Final = {"ms": 0.001, "s": 1.0, "min": 60.0, "h": 3600.0}
_MAX_SECONDS: Final = 24 * 3600.0
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_CELL_NAME = re.compile(r"[a-z0-9][a-z0-9-]*")
_MAX_NAME: Final = 64
_NUMBERS = re.compile(r"[0-9.]+")
_MAPPED_PREFIX: Final = 96
"""Bits in front of the IPv4 address in an IPv4-mapped one."""


def refuse(rule: Rule, message: str, hint: str) -> NoReturn:
    """Stop the validation of a value: it breaks `rule`."""
    raise ValueRefused(rule.slug, message, hint)


def written(value: object) -> str:
    """Return a scalar as it was written."""
    if isinstance(value, (WholeNumber, RealNumber)):
        return value.text
    if value is None:
        return "nothing"
    return str(value).lower() if isinstance(value, bool) else str(value)


def scalar(value: object, what: str, hint: str) -> str:
    """A plain value as it was written; anything else is refused, since `what` is expected there."""
    if type(value) in _NO_SCALARS:
        refuse(syntax.WRONG_TYPE, f"{_NO_SCALARS[type(value)]} stands where {what} is expected", hint)
    return written(value)


_NO_SCALARS: Final[dict[type, str]] = {
    dict: "a table", list: "a list", tuple: "a list", bool: "true or false", type(None): "nothing"
}  # fmt: skip


def _decimal(value: object) -> object:
    """Let only plain decimal numbers pass; other shapes are read differently by different tools."""
    hint = "write a plain decimal number such as 10 or 0.5"
    if isinstance(value, str):
        if _NUMBER_LIKE.fullmatch(value):
            refuse(syntax.BAD_NUMBER, f"`{value}` is not a plain decimal number", f"{hint}, without quotes")
        measured = _MEASURED.fullmatch(value)
        if measured is not None:
            factor = _FACTORS.get(measured[2] or "", 1)
            hint = f"write {float(measured[1]) * factor:.10g}, without the unit"
        refuse(syntax.WRONG_TYPE, f"`{value}` stands where a number is expected", hint)
    if isinstance(value, (WholeNumber, RealNumber)) and not _DECIMAL.fullmatch(value.text):
        refuse(syntax.BAD_NUMBER, f"`{value.text}` is not a plain decimal number", hint)
    if isinstance(value, float):
        if not math.isfinite(value):
            refuse(syntax.BAD_NUMBER, f"`{written(value)}` is not a finite number", hint)
        return float(value)
    return int(value) if isinstance(value, WholeNumber) else value


Whole = Annotated[int, BeforeValidator(_decimal)]
"""An integer in plain decimal digits."""
Real = Annotated[float, BeforeValidator(_decimal)]
"""A number in plain decimal digits."""


def _plain(value: object) -> object:
    """A value of a variable: true or false, or a plain decimal number."""
    if isinstance(value, bool):
        return value
    if not isinstance(value, (int, float)):
        hint = "write true or false for a bit, and a plain decimal number such as 10 or 0.5 for any other"
        text = scalar(value, "a value", hint)
        refuse(syntax.WRONG_TYPE, f"`{text}` is not a value", hint)
    return _decimal(value)


Plain = Annotated[InstanceOf[Value], BeforeValidator(_plain, json_schema_input_type=bool | float)]
"""True, false or a number, as it was written."""


def _duration(value: object) -> float:
    hint = "name the unit: 500ms, 2s, 1.5s or 5min"
    text = scalar(value, "a duration", hint)
    match = _DURATION.fullmatch(text)
    if match is None:
        if isinstance(value, (int, float)):
            refuse(
                syntax.BAD_DURATION,
                f"the duration `{text}` has no unit",
                f"write {text}ms, {text}s or {text}min" if value > 0 else hint,
            )
        refuse(syntax.BAD_DURATION, f"`{text}` is not a duration", hint)
    seconds = float(match[1]) * _SECONDS[match[2]]
    if not 0 < seconds <= _MAX_SECONDS:
        refuse(
            syntax.OUT_OF_RANGE,
            f"the duration `{text}` is not between 1ms and 24h",
            "write a longer or shorter one, or leave the key out: the reference has its default",
        )
    return seconds


def optional_duration(value: object) -> float | None:
    """Read a duration in seconds, or `none`."""
    return None if value == "none" else _duration(value)


_DURATION_SCHEMA = Annotated[
    str, Field(pattern=r"^[0-9]+(\.[0-9]+)? ?(ms|s|min|h)$", examples=["500ms", "2s"])
]
OPTIONAL_DURATION_SCHEMA = Annotated[
    str, Field(pattern=r"^(none|[0-9]+(\.[0-9]+)? ?(ms|s|min|h))$", examples=["none", "60s"])
]
Duration = Annotated[float, BeforeValidator(_duration, json_schema_input_type=_DURATION_SCHEMA)]
"""Seconds, written with a unit."""
OptionalDuration = Annotated[
    float | None, BeforeValidator(optional_duration, json_schema_input_type=OPTIONAL_DURATION_SCHEMA)
]
"""Seconds, written with a unit, or `none`."""


@dataclass(frozen=True, slots=True)
class ListenAddress:
    """Where a listener listens."""

    host: str
    """A literal IP address."""
    port: int

    def __str__(self) -> str:
        """`host:port`, with brackets around IPv6."""
        return address_text(self.host, self.port)


def _unmapped(address: IPv4Address | IPv6Address) -> IPv4Address | IPv6Address:
    """An IPv4-mapped address (`::ffff:192.0.2.20`) is an IPv4 address in the notation of IPv6."""
    return (isinstance(address, IPv6Address) and address.ipv4_mapped) or address


def _listen(value: object) -> ListenAddress:
    if isinstance(value, ListenAddress):
        return value
    hint = "write host:port, for example 127.0.0.1:1502, 0.0.0.0:502 or [::1]:502"
    text = scalar(value, "a listen address", hint)
    host, port = split_address(text) or ("", None)
    if port is None:
        refuse(syntax.BAD_NETWORK, f"`{text}` is not a listen address", hint)
    try:
        address = ip_address(host)
    except ValueError:
        refuse(syntax.BAD_NETWORK, f"`{host}` is not an IP address", "names are not resolved here; " + hint)
    if text.startswith("[") != isinstance(address, IPv6Address):
        refuse(syntax.BAD_NETWORK, f"`{text}` is not a listen address", hint)
    address = _unmapped(address)
    if not 0 < port <= MAX_PORT:
        refuse(syntax.OUT_OF_RANGE, f"port {port} is not between 1 and 65535", hint)
    return ListenAddress(str(address), port)


Listen = Annotated[
    InstanceOf[ListenAddress],
    BeforeValidator(
        _listen,
        json_schema_input_type=Annotated[
            str, Field(pattern=r"^(\[[0-9A-Fa-f:.]+\]|[0-9.]+):[0-9]{1,5}$", examples=["127.0.0.1:1502"])
        ],
    ),
]
"""A literal IP address and a port."""


def _host(text: str) -> str:
    """What looks like an address must be one: no name server will know `192.0.2.300`."""
    if _NUMBERS.fullmatch(text):
        try:
            IPv4Address(text)
        except ValueError:
            hint = "write four numbers from 0 to 255 without leading zeros, for example 192.0.2.10"
            refuse(syntax.BAD_NETWORK, f"`{text}` is not an IP address", hint)
    elif ":" in text:
        try:
            return str(_unmapped(IPv6Address(text)))
        except ValueError:
            host, _, port = text.partition(":")
            hint = f"write `host: {host}` and `port: {port}`" if port.isdigit() else "for example 192.0.2.10"
            refuse(syntax.BAD_NETWORK, f"`{text}` is neither a host name nor an IP address", hint)
    return text


Host = Annotated[
    str,
    Field(min_length=1, max_length=253, pattern=r"^[A-Za-z0-9._:%-]+$"),
    AfterValidator(_host),
]
"""A host name or a literal IP address."""


Network: TypeAlias = IPv4Network | IPv6Network


def _network(value: object) -> Network:
    hint = "write an address (192.0.2.20) or a network (192.0.2.0/28)"
    text = scalar(value, "an IP address or network", hint)
    try:
        network = ip_network(text)
    except ValueError:
        pass
    else:
        mapped = _unmapped(network.network_address)
        if network.version == mapped.version or network.prefixlen < _MAPPED_PREFIX:
            return network
        return ip_network(f"{mapped}/{network.prefixlen - _MAPPED_PREFIX}")
    try:
        network = ip_network(text, strict=False)
    except ValueError:
        refuse(syntax.BAD_NETWORK, f"`{text}` is neither an IP address nor a network", hint)
    host = text.partition("/")[0]
    hint = f"write {network} for the whole network, or {host} for the one address"
    refuse(syntax.BAD_NETWORK, f"`{text}` has host bits set", hint)


def one_or_many(value: object) -> object:
    """One thing may stand for a list of one."""
    if isinstance(value, (list, tuple)):
        return tuple(value) or refuse(
            syntax.WRONG_TYPE, "the list is empty", "name at least one, or remove the key"
        )
    if isinstance(value, str) and "," in value:
        refuse(syntax.WRONG_TYPE, f"`{value}` is not a list", f"a list needs brackets: [{value}]")
    return (value,)


_NETWORK_SCHEMA = Annotated[str, Field(examples=["192.0.2.20", "192.0.2.0/28"])]
_OneNetwork = Annotated[
    IPv4Network | IPv6Network, BeforeValidator(_network, json_schema_input_type=_NETWORK_SCHEMA)
]
Networks = Annotated[
    tuple[_OneNetwork, ...],
    BeforeValidator(one_or_many, json_schema_input_type=_NETWORK_SCHEMA | list[_NETWORK_SCHEMA]),
]
"""An address, a network, or a list of them."""


def _name(value: object) -> str:
    hint = "a name begins with a letter and goes on with letters (a to z), digits and `_`"
    text = scalar(value, "a name", hint)
    if not _NAME.fullmatch(text):
        joined = "_".join(re.findall(r"[A-Za-z0-9_]+", text))
        if _NAME.fullmatch(joined):
            hint = f"write {joined}: {hint}"
        refuse(syntax.BAD_NAME, f"`{text}` is not a name", hint)
    if len(text) > _MAX_NAME:
        refuse(syntax.BAD_NAME, f"the name `{text}` has {len(text)} characters", f"use at most {_MAX_NAME}")
    return text


def _cell_name(value: object) -> str:
    hint = "use small letters, digits and `-`, for example press-3"
    text = scalar(value, "a name", hint)
    if not _CELL_NAME.fullmatch(text) or len(text) > _MAX_NAME:
        refuse(syntax.BAD_NAME, f"`{text}` is not a name of a cell", hint)
    return text


_NAME_SCHEMA = Annotated[str, Field(pattern="^[A-Za-z][A-Za-z0-9_]{0,63}$")]
Name = Annotated[str, BeforeValidator(_name, json_schema_input_type=_NAME_SCHEMA)]
"""Name of a writer, group or variable."""
CellName = Annotated[
    str,
    BeforeValidator(
        _cell_name, json_schema_input_type=Annotated[str, Field(pattern="^[a-z0-9][a-z0-9-]{0,63}$")]
    ),
]
"""Name of a cell."""
Names = Annotated[
    tuple[Name, ...],
    BeforeValidator(one_or_many, json_schema_input_type=_NAME_SCHEMA | list[_NAME_SCHEMA]),
]
"""A name or a list of names."""


def span(text: str, match: re.Match[str], first: str, last: str) -> range | None:
    """The numbers from one group of a match to another, both included; None where there are none."""
    if match[first] is None:
        return None
    low = int(match[first])
    high = int(match[last]) if match[last] is not None else low
    if high < low:
        hint = f"write {text.replace(f'{match[first]}..{match[last]}', f'{high}..{low}')}"
        refuse(syntax.BAD_RANGE, f"the range of `{text}` runs backwards", hint)
    return range(low, high + 1)


def _policy(value: Any, words: tuple[str, ...]) -> Fallback:
    if isinstance(value, Fallback):
        return value
    choices = ", ".join(words) + " or a value"
    if isinstance(value, bool):
        return Fallback(FallbackKind.VALUE, value)
    if isinstance(value, (int, float)):
        return Fallback(FallbackKind.VALUE, _decimal(value))  # type: ignore[arg-type]
    text = scalar(value, "a policy", f"write {choices}")
    if text not in words:
        refuse(syntax.BAD_CHOICE, f"`{text}` is not a policy", did_you_mean(text, words, f"write {choices}"))
    return Fallback(FallbackKind(text))


ReleasePolicy = Annotated[
    InstanceOf[Fallback],
    BeforeValidator(
        partial(_policy, words=("clear", "hold")),
        json_schema_input_type=bool | float | Literal["clear", "hold"],
    ),
]
"""What an input is given when its owner is lost."""
OutputPolicy = Annotated[
    InstanceOf[Fallback],
    BeforeValidator(
        partial(_policy, words=("clear", "hold", "exception")),
        json_schema_input_type=bool | float | Literal["clear", "hold", "exception"],
    ),
]
"""What the fieldbus sees of an output when the robot stops reporting."""
