"""The kinds of links do not get in each other's way."""

from __future__ import annotations

from importlib import import_module
from inspect import getmembers, isclass

import pytest

from gatewayd.core.status_layout import FIELDS, HEADER_WORDS
from gatewayd.links.contract import Link, LinkKind, Medium, SharedPart, TrafficDecoder
from gatewayd.links.examination import Examination
from gatewayd.links.registry import LINK_KINDS, decoder_of, examination_of, kind_of, kinds, status_fields
from gatewayd.mapping.plan import LinkPlan


def test_every_package_has_a_kind_with_a_key_of_its_own() -> None:
    assert len(kinds()) == len(LINK_KINDS)
    assert len({kind.key for kind in kinds()}) == len(LINK_KINDS)
    assert [kind_of(kind.key) for kind in kinds()] == list(kinds())


def test_kinds_have_words_of_the_status_block_of_their_own() -> None:
    fields = status_fields()
    assert set(FIELDS) < set(fields)
    words = [word for field in fields for word in range(field.offset, field.offset + field.words)]
    assert len(words) == len(set(words))
    assert max(words) < HEADER_WORDS
    assert len({field.name for field in fields}) == len(fields)


def test_kinds_have_metrics_of_their_own() -> None:
    names = [metric.name for kind in kinds() for metric in kind.metrics]
    assert len(names) == len(set(names))
    assert all(name.startswith("gatewayd_") for name in names)


def test_plans_know_their_kind() -> None:
    for package, kind in zip(LINK_KINDS, kinds(), strict=True):
        module = import_module(f"{package}.plan")
        found = [its for _, its in getmembers(module, isclass) if its.__module__ == module.__name__]
        assert [plan.kind for plan in found if issubclass(plan, LinkPlan)] == [kind.key]


def test_a_kind_that_is_none_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gatewayd.links.robot.declaration.KIND", "robot")
    kinds.cache_clear()
    with pytest.raises(TypeError, match=r"gatewayd\.links\.robot\.declaration\.KIND is no LinkKind"):
        kinds()


def test_every_kind_has_a_decoder_of_its_own() -> None:
    assert {kind.key: decoder_of(kind.key).medium for kind in kinds()} == {
        "robot": Medium.TCP_CLIENT,
        "dashboard": Medium.TCP_CLIENT,
        "modbus": Medium.TCP_SERVER,
        "canopen": Medium.CAN,
        "device": Medium.OTHER,
        "mqtt": Medium.TCP_CLIENT,
        "standby": Medium.OTHER,
    }
    assert decoder_of("modbus") is not decoder_of("modbus"), (
        "what one remembers is none of the other's business"
    )


def test_a_kind_need_not_offer_a_tap() -> None:
    Link().trace(lambda _passage: None)
    SharedPart().trace(None)
    assert TrafficDecoder().words(b"\1\2", "", outgoing=True) == "length 2: 01 02"
    assert TrafficDecoder().words(bytes(20), "", outgoing=True).endswith("00 ...")


def test_every_kind_says_what_is_to_be_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    assert all(isinstance(examination_of(kind.key), Examination) for kind in kinds())
    monkeypatch.setattr(type(kind_of("modbus")), "doctor", LinkKind.doctor)
    assert examination_of("modbus") is None
