from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gatewayd.web.hosts import forwarded_peer, is_from_elsewhere, is_ours, name_of, network_of, normal_address


@pytest.mark.parametrize(
    "host, name",
    [
        ("Gateway.plant:9502", "gateway.plant"),
        ("192.0.2.5", "192.0.2.5"),
        ("[2001:db8::0:1]:9502", "2001:db8::1"),
        ("", None),
        ("a:b", None),
        ("a:99999", None),
        ("user@gateway", None),
        ("gateway/path", None),
        ("[::1", None),
        ("[1.2.3]", None),
        ("a b", None),
        ("a" * 301, None),
    ],
)
def test_the_name_in_a_host_header(host: str, name: str | None) -> None:
    assert name_of(host) == name


@pytest.mark.parametrize(
    "host, ours",
    [
        ("localhost", True),
        ("press.localhost:9502", True),
        ("127.0.0.1:9502", True),
        ("[::1]:1", True),
        ("192.0.2.5:9502", True),
        ("gw1.plant", True),
        ("GW1.PLANT:443", True),
        ("192.0.2.6", False),
        ("gw1.plant.evil.example", False),
        ("evil.example", False),
        ("localhost.evil.example", False),
        ("gw1.plant.", False),
        ("", False),
    ],
)
def test_only_declared_names_and_own_addresses_are_ours(host: str, ours: bool) -> None:
    assert is_ours(host, {"gw1.plant"}, ("192.0.2.5",)) is ours


@pytest.mark.parametrize(
    "origin, site, foreign",
    [
        (None, None, False),
        ("https://gw1:9502", None, False),
        ("http://gw1:9502", "same-origin", False),
        ("https://gw1:9502", "cross-site", True),
        (None, "same-site", True),
        (None, "cross-site", True),
        (None, "none", False),
        ("https://gw1", None, True),
        ("https://evil.example", None, True),
        ("https://evil.example", "same-origin", True),
        ("null", None, True),
        ("", None, True),
        ("file://gw1:9502", None, True),
    ],
)
def test_pages_of_other_sites_change_nothing(origin: str | None, site: str | None, foreign: bool) -> None:
    origins, sites = ([] if one is None else [one] for one in (origin, site))
    assert is_from_elsewhere(origins, sites, "gw1:9502") is foreign


def test_of_several_origins_each_has_to_be_ours() -> None:
    assert is_from_elsewhere(["https://gw1:9502", "https://evil.example"], [], "gw1:9502")
    assert is_from_elsewhere([], ["same-origin", "cross-site"], "gw1:9502")


@pytest.mark.parametrize(
    "headers, peer",
    [
        ([], None),
        (["192.0.2.7"], "192.0.2.7"),
        (["198.51.100.1, 192.0.2.7"], "192.0.2.7"),
        (["198.51.100.1", "192.0.2.7"], "192.0.2.7"),
        (["192.0.2.7, unknown"], None),
        (["192.0.2.7", ""], None),
        (["192.0.2.7:1234"], None),
        (["::ffff:192.0.2.7"], "192.0.2.7"),
    ],
)
def test_of_what_a_proxy_forwards_only_its_own_word_counts(headers: list[str], peer: str | None) -> None:
    assert forwarded_peer(headers) == peer


def test_addresses_are_compared_in_one_form() -> None:
    assert normal_address("::ffff:192.0.2.7") == "192.0.2.7"
    assert normal_address("fe80::1%eth0") == "fe80::1"
    assert normal_address("?") == "?"


@given(st.text(max_size=80), st.text(max_size=80))
def test_whatever_the_headers_are(host: str, origin: str) -> None:
    is_ours(host, {"gw1"}, ())
    is_from_elsewhere([origin], [host], host)
    forwarded_peer([host, origin])
    network_of(host)
