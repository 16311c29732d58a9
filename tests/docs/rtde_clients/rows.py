"""What a user of another RTDE client has, and what there is here instead: the rows of docs/reference/rtde-clients.md.

The rows are in the .tsv files beside this module, one file for each client, written by hand: group, their name, what
it does, ours, and a key of `SHOWN`. `ours` names things of `gatewayd.rtde` as `rtde.NAME`, commands as `gatewayd ...`;
where there is nothing it begins with "not" and gives the reason.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import groupby
from pathlib import Path

from tests.docs.canopen import table

HERE = Path(__file__).parent
CLIENTS = ("python", "cpp", "dotnet")

SHOWN: dict[str, str] = {
    "addresses": "rtde/api/test_robot.py::test_what_was_agreed_can_be_read",
    "alone": "rtde/test_standing_alone.py::test_the_whole_api_loads_no_foreign_library",
    "analog": "rtde/api/test_writing.py::test_analog_outputs_are_set_in_their_unit",
    "arrays": "rtde/recording/test_arrays.py::test_fields_have_their_shapes_types_and_values",
    "binary": "rtde/recording/test_writing.py::test_binary_is_two_lines_of_names_and_types_and_then_payloads",
    "bits": "rtde/api/test_writing.py::test_bits_keep_their_neighbours",
    "boot": "rtde/api/test_robot.py::test_the_boot_is_waited_for",
    "codec": "rtde/test_codec.py::test_a_client_hears_what_a_controller_says_however_it_is_cut",
    "connect": "rtde/api/test_robot.py::test_what_was_agreed_can_be_read",
    "writing CSV": "rtde/recording/test_writing.py::test_text_is_the_official_writers_but_for_booleans_and_line_ends",
    "reading CSV": "rtde/recording/test_reading.py::test_what_is_written_is_read",
    "data types": "rtde/test_recipe.py::test_types_have_the_guides_sizes",
    "digital": "rtde/api/test_writing.py::test_digital_outputs_switch_alone",
    "enums": "rtde/test_enums.py::test_numbers_are_the_guides",
    "errors": "rtde/api/test_errors.py::test_each_names_its_fields",
    "events": "rtde/api/test_events.py::test_an_event_reads_as_a_line",
    "every": "rtde/api/test_robot.py::test_every_package_comes_in_its_order",
    "field": "rtde/test_fields.py::test_catalogue_agrees_with_the_newer_guide",
    "fields": "cli/rtde/test_fields.py::test_the_catalogue_needs_no_controller",
    "frequency": "rtde/api/test_robot.py::test_what_was_agreed_can_be_read",
    "info": "cli/rtde/test_info.py::test_a_controller_says_what_it_is",
    "inputs": "rtde/api/test_writing.py::test_recipes_are_sent_each_by_itself",
    "known": "rtde/api/test_writing.py::test_what_is_held_is_known_without_read_back",
    "loop": "docs/test_examples.py::test_control_loop",
    "message": "rtde/api/test_robot.py::test_texts_come_as_events_and_go_to_the_log",
    "messages": "rtde/test_payloads.py::test_every_package_type_is_decoded_in_both_directions_and_versions",
    "newer": "rtde/api/test_robot.py::test_newer_passes_over_what_is_older",
    "overflow": "rtde/api/test_robot.py::test_a_slow_reader_is_told_what_it_lost",
    "pause": "rtde/api/test_robot.py::test_pausing_changing_and_going_on",
    "plot": "cli/rtde/test_plot.py::test_fields_title_and_filter",
    "properties": "rtde/api/test_robot.py::test_properties_are_told_by_new_controllers",
    "protocol": "rtde/api/test_robot.py::test_protocol_1_can_be_forced_and_is_the_only_one_of_old_controllers",
    "recipe": "rtde/test_recipe.py::test_values_survive_packing",
    "recipe files": "rtde/recipes/test_reading.py::test_the_guides_example_is_read_as_the_python_client_reads_it",
    "record": "cli/rtde/test_record.py::test_every_package_is_there_until_the_wanted_number",
    "refused": "rtde/api/test_robot.py::test_a_refused_field_is_named_with_its_likely_holder",
    "refused writes": "rtde/api/test_writing.py::test_without_a_reading_the_missing_fields_are_named",
    "retry": "rtde/api/test_retry.py::test_attempts_are_counted_apart",
    "sample": "rtde/api/test_sample.py::test_a_field_is_an_attribute_and_an_item",
    "set": "cli/rtde/test_set.py::test_everything_is_written_shown_by_the_robot_and_given_back",
    "set-up": "rtde/api/test_robot.py::test_pausing_changing_and_going_on",
    "slider": "rtde/api/test_writing.py::test_the_speed_slider_is_not_set_to_zero_by_accident",
    "state": "rtde/api/test_robot.py::test_by_hand_nothing_is_reconnected",
    "text": "rtde/api/test_robot.py::test_texts_come_as_events_and_go_to_the_log",
    "texts in the handshake": "rtde/test_client.py::test_texts_are_tolerated_anywhere",
    "timeouts": "rtde/api/test_robot.py::test_limits_end_the_attempts",
    "types": "rtde/api/test_robot.py::test_declared_types_are_compared",
    "version": "rtde/api/test_robot.py::test_what_was_agreed_can_be_read",
    "write": "rtde/api/test_writing.py::test_recipes_are_sent_each_by_itself",
}
"""What shows that ours does it: key -> test, as `FILE::FUNCTION` below tests/."""


@dataclass(frozen=True, slots=True)
class Row:
    """Something public of another client."""

    client: str
    group: str
    name: str
    what: str
    ours: str
    shown_by: str

    @property
    def references(self) -> list[str]:
        """Names of `gatewayd.rtde` in `ours`, without that prefix."""
        return [name for name in re.findall(r"`rtde\.([\w.]+)", self.ours) if not name.endswith("connect(")]

    @property
    def commands(self) -> list[str]:
        """Commands in `ours`, with options."""
        return re.findall(r"`gatewayd ((?:[a-z-]+ ?)+[^`]*)`", self.ours)

    @property
    def is_declined(self) -> bool:
        """Whether there is nothing, for a reason."""
        return self.ours.startswith("not")


@cache
def rows() -> tuple[Row, ...]:
    """All rows, client by client."""
    return tuple(row for client in CLIENTS for row in _read(client))


def _read(client: str) -> Iterator[Row]:
    with (HERE / f"{client}.tsv").open(newline="") as file:
        reader = csv.reader(file, delimiter="\t", quoting=csv.QUOTE_NONE)
        next(reader)
        for columns in reader:
            yield Row(client, *columns)


def part(client: str) -> str:
    """The tables of one client."""
    mine = [row for row in rows() if row.client == client]
    return "\n\n".join(
        f"### {group}\n\n" + table(("theirs", "what it does", "ours", "shown by"), map(_cells, members))
        for group, members in groupby(mine, key=lambda row: row.group)
    )


def _cells(row: Row) -> tuple[str, str, str, str]:
    file = SHOWN[row.shown_by].split("::")[0]
    return row.name, row.what, row.ours, f"[{row.shown_by}](../../tests/{file})"
