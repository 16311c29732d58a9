"""Where what lies in the status block never changes."""

from __future__ import annotations

from itertools import pairwise

from gatewayd.core.status_layout import (
    BASE,
    FIELDS,
    HEADER_WORDS,
    LAYOUT_VERSION,
    LENGTH,
    LINK_TABLES,
    TABLES,
    StatusField,
    StatusTable,
)
from gatewayd.links.registry import status_tables

ENTRIES: list[StatusField | StatusTable] = [*FIELDS, *TABLES]

HEADER = (
    (0, 1, "layout"),
    (1, 1, "flags"),
    (2, 2, "fingerprint"),
    (4, 1, "heartbeat"),
    (5, 1, "variables"),
    (6, 1, "writers"),
    (7, 1, "robot_state"),
    (8, 2, "uptime"),
    (10, 2, "robot_age"),
    (12, 1, "frequency"),
    (13, 1, "sessions"),
    (14, 2, "packages"),
    (16, 2, "skipped"),
    (18, 2, "late"),
    (20, 2, "accepted"),
    (22, 2, "refused"),
    (24, 2, "mismatches"),
    (30, 1, "refusal_reason"),
    (31, 1, "refusal_variable"),
    (32, 1, "refusal_writer"),
    (33, 1, "refusal_holder"),
    (34, 2, "refusal_age"),
    (40, 1, "request"),
    (41, 1, "release"),
    (42, 1, "unadopted"),
    (43, 1, "differing"),
    (44, 2, "lag"),
    (46, 1, "adoption"),
    (47, 1, "program"),
    (48, 1, "gaps"),
    (49, 2, "unserved"),
    (51, 1, "unserved_reason"),
)
"""The header as PLC programs have it built in: entries are only appended. With the links' numbers between them
they stand in tests/golden/contracts."""
BLOCKS = (
    (64, 64, "good"),
    (128, 64, "writers_alive"),
    (192, 1024, "owner"),
    (1216, 1024, "lease"),
    (2240, 1024, "age"),
    (3264, 1024, "quality"),
)
"""Likewise the tables, 5F01h and the following."""


def test_the_layout_is_a_contract() -> None:
    assert (BASE, LAYOUT_VERSION, LENGTH) == (60000, 1, 4800)
    assert tuple((field.offset, field.words, field.name) for field in FIELDS) == HEADER
    assert tuple((table.offset, table.words, table.name) for table in TABLES) == BLOCKS


def test_fields_and_tables_lie_one_after_the_other() -> None:
    assert all(one.offset + one.words <= next_one.offset for one, next_one in pairwise(ENTRIES))
    assert FIELDS[-1].offset < HEADER_WORDS == TABLES[0].offset
    assert TABLES[-1].offset + TABLES[-1].words == LINK_TABLES
    links = status_tables()
    assert (links[0].offset, links[-1].offset + links[-1].words) == (LINK_TABLES, LENGTH)
