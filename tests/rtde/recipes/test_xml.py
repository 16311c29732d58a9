"""The XML of the Python client, and what is wrong with it."""

from __future__ import annotations

import pytest

from gatewayd.rtde.recipes.declared import RecipeProblem
from gatewayd.rtde.recipes.xml import parse_xml
from tests.rtde.recipes.samples import GUIDE


def problems(text: str) -> list[str]:
    found: list[RecipeProblem] = []
    parse_xml(text.encode(), "x.xml", found)
    return [f"{problem.line}: {problem.text}" for problem in found]


def within(field: str) -> str:
    return f'<rtde_config>\n<recipe key="out">\n{field}\n</recipe>\n</rtde_config>\n'


@pytest.mark.parametrize(
    "text, expected",
    [
        (
            within('<field name="timestamp" type="DUOBLE"/>'),
            "3: timestamp has the type 'DUOBLE', which RTDE does not have; did you mean DOUBLE?",
        ),
        (
            within('<field name="timestamp"/>'),
            '3: timestamp has no type; write one, as in type="DOUBLE"',
        ),
        (
            within('<field type="DOUBLE"/>'),
            "3: a field without a name; give it one, as in timestamp",
        ),
        (
            within('<field name="timestamp,actual_q" type="DOUBLE"/>'),
            "3: 'timestamp,actual_q' is no name of a field; one is made of letters, digits and underscores",
        ),
        (
            within('<feild name="timestamp" type="DOUBLE"/>\n<field name="payload" type="DOUBLE"/>'),
            '3: unexpected element <feild>; here stands <field name="timestamp" type="DOUBLE"/>',
        ),
        (
            within('<field name="payload" type="DOUBLE"/>\n\n<field name="payload" type="DOUBLE"/>'),
            "5: payload is in the recipe already, since line 3; strike one of them",
        ),
        (
            within('timestamp\n<field name="payload" type="DOUBLE"/>'),
            '3: unexpected text \'timestamp\'; a field is written <field name="timestamp" type="DOUBLE"/>',
        ),
        (
            within('<field name="payload" type="DOUBLE"><b/></field>'),
            "3: unexpected element <b>; nothing stands in a field",
        ),
        (
            '<rtde_config>\n<recipe>\n<field name="payload" type="DOUBLE"/></recipe></rtde_config>',
            '2: a recipe without a key; give it one, as in key="out"',
        ),
        (
            '<rtde_config>\n<recipe key="out">\n</recipe></rtde_config>',
            '3: the recipe \'out\' has no field; write one, as in <field name="timestamp" type="DOUBLE"/>',
        ),
        ("<rtde_config>\n<recipe", "2: this is no XML: unclosed token, in column 1; mend it there"),
        (
            '<?xml version="1.0" encoding="klingon"?>\n<a/>',
            "1: its encoding cannot be read: unknown encoding: klingon; save it as UTF-8",
        ),
    ],
)
def test_each_mistake_has_its_line_its_value_and_a_remedy(text: str, expected: str) -> None:
    assert expected in problems(text)


def test_a_field_that_no_guide_has_is_taken_as_it_is_declared() -> None:
    """The controller decides which fields there are."""
    found: list[RecipeProblem] = []
    (recipe,) = parse_xml(within('<field name="brand_new" type="VECTOR3D"/>').encode(), "x.xml", found)
    assert found == []
    assert [(field.name, field.type.word if field.type else None) for field in recipe.fields] == [
        ("brand_new", "VECTOR3D")
    ]


BOMB = """\
<?xml version="1.0"?>
<!DOCTYPE rtde_config [
  <!ENTITY a "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa">
  <!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">
  <!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;">
]>
<rtde_config><recipe key="out">&c;</recipe></rtde_config>
"""
EXTERNAL = '<!DOCTYPE a SYSTEM "file:///etc/hostname">\n<rtde_config/>'


@pytest.mark.parametrize("text, line", [(BOMB, 2), (EXTERNAL, 1)])
def test_a_document_type_is_refused_before_any_entity(text: str, line: int) -> None:
    refused = "it declares a document type, which recipes have no use for; strike <!DOCTYPE ...>"
    assert problems(text) == [f"{line}: {refused}"]


def test_a_file_of_another_kind_is_not_answered_with_a_line_for_each_of_its_own() -> None:
    assert len(problems("<html>" + "<p>no</p>\n" * 1000 + "</html>")) <= 21


def test_very_deep_elements() -> None:
    assert "unexpected element" in problems("<a>" * 100_000)[0]


def test_the_guides_example_is_right() -> None:
    assert problems(GUIDE) == []
