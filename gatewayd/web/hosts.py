"""By which names a request may call the listener, and from which pages it may come. Pure.

A browser on the plant's network can be led here under another site's name (DNS rebinding), and a page of another site
can send requests here. So the Host header must be a name of ours on every address (RFC 9110, 7.4: 421), and what
changes anything must come from our own page or from no page at all.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from ipaddress import IPv6Address, ip_address, ip_network

from gatewayd.web.settings import is_loopback

MAX_HOST = 300
"""Characters of a Host header that is looked at."""

_HOST = re.compile(r"(\[[0-9a-fA-F:.]+\]|[^\[\]:/?#@\\\s]+)(?::([0-9]{1,5}))?")
_FROM_HERE = ("same-origin", "none")
"""Values of Sec-Fetch-Site (W3C Fetch Metadata): our own page, or a person at the address bar."""


def name_of(host: str) -> str | None:
    """The name or address in a Host header, in lower case and without brackets; None: it is malformed."""
    found = _HOST.fullmatch(host) if len(host) <= MAX_HOST else None
    if found is None or (found[2] is not None and int(found[2]) > 65535):
        return None
    name = found[1].lower()
    return _normal(name[1:-1]) if name.startswith("[") else name


def is_ours(host: str, names: Collection[str], own_addresses: Collection[str]) -> bool:
    """Whether a Host header calls this listener: `names` are declared, `own_addresses` those of the connection.

    A client that comes through a tunnel calls it localhost, or by a loopback address.
    """
    name = name_of(host)
    if name is None:
        return False
    return is_loopback(name) or name.endswith(".localhost") or name in names or name in own_addresses


def is_from_elsewhere(origins: Sequence[str], fetch_sites: Sequence[str], host: str) -> bool:
    """Whether a request was made by a page of another site: by its Origin (RFC 6454) and Sec-Fetch-Site headers.

    A program sends neither. Of several of one name, which no browser sends, every one has to be ours.
    """
    return any(site not in _FROM_HERE for site in fetch_sites) or not all(
        _is_page_of(origin, host) for origin in origins
    )


def _is_page_of(origin: str, host: str) -> bool:
    scheme, separator, rest = origin.partition("://")
    return bool(separator) and scheme in ("http", "https") and rest.lower() == host.lower()


def normal_address(address: str) -> str:
    """An address as it is compared: IPv4 within IPv6 is IPv4, and no zone."""
    try:
        found = ip_address(address.partition("%")[0])
    except ValueError:
        return address
    mapped = getattr(found, "ipv4_mapped", None)
    return str(mapped or found)


def forwarded_peer(headers: Sequence[str]) -> str | None:
    """The address that a trusted proxy saw: the last one of X-Forwarded-For; those before it anybody may have sent.

    Also where it stands in a header of its own below the client's, as some proxies add it (RFC 9110, 5.3).
    """
    last = headers[-1].rpartition(",")[2].strip() if headers else ""
    try:
        return normal_address(str(ip_address(last)))
    except ValueError:
        return None


def network_of(peer: str) -> str:
    """Whom a peer counts as: an IPv4 address, or an IPv6 network of 64 bits, which one machine has as a whole."""
    address = normal_address(peer)
    try:
        found = ip_address(address)
    except ValueError:
        return peer
    return str(ip_network((found, 64), strict=False)) if isinstance(found, IPv6Address) else address


def _normal(address: str) -> str | None:
    try:
        return str(ip_address(address))
    except ValueError:
        return None
