"""Recipe files of the Python client (`rtde_config.ConfigFile`): XML with a key, names and types.

    <rtde_config>
      <recipe key="out">
        <field name="timestamp" type="DOUBLE"/>
      </recipe>
    </rtde_config>

Read by expat itself: unlike the tree of the standard library it knows the line of each element, and says when a
document type begins. Such a file is refused there and then, so no entity is ever declared, expanded or fetched; the
size was bounded before.
"""

from __future__ import annotations

from typing import NoReturn
from xml.parsers import expat

from gatewayd.rtde.recipes.declared import (
    DeclaredField,
    DeclaredRecipe,
    RecipeProblem,
    problems_of_key,
    problems_of_name,
    problems_of_repeats,
    problems_of_type,
)
from gatewayd.rtde.types import DataType

_MAX_PROBLEMS = 20
_MEANT = ("<rtde_config>", '<recipe key="out">', '<field name="timestamp" type="DOUBLE"/>')
"""What is written in a file at each depth."""


class _EnoughError(Exception):
    """Reading on would tell nobody more."""


def parse_xml(data: bytes, name: str, problems: list[RecipeProblem]) -> list[DeclaredRecipe]:
    """The recipes in their order; what is wrong is added to `problems`. Broken XML ends the reading."""
    document = _Document(name, problems)
    try:
        document.parser.Parse(data, True)
    except expat.ExpatError as error:
        text = f"this is no XML: {expat.ErrorString(error.code)}, in column {error.offset + 1}; mend it there"
        problems.append(RecipeProblem(error.lineno, text))
    except (ValueError, LookupError) as error:  # an encoding that Python does not have, or not for this
        problems.append(RecipeProblem(1, f"its encoding cannot be read: {error}; save it as UTF-8"))
    except _EnoughError:
        pass
    return document.recipes


class _Document:
    """Takes in the elements as expat comes by them."""

    def __init__(self, name: str, problems: list[RecipeProblem]) -> None:
        self.recipes: list[DeclaredRecipe] = []
        self._name = name
        self._problems = problems
        self._depth = 0
        self._key, self._line = "", 0
        self._fields: list[DeclaredField] = []
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._text
        self.parser.StartDoctypeDeclHandler = self._refuse

    def _report(self, *texts: str) -> None:
        self._problems += [RecipeProblem(self.parser.CurrentLineNumber, text) for text in texts]
        if len(self._problems) >= _MAX_PROBLEMS:
            raise _EnoughError

    def _refuse(self, *_declared: object) -> NoReturn:
        self._report("it declares a document type, which recipes have no use for; strike <!DOCTYPE ...>")
        raise _EnoughError

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        depth, self._depth = self._depth, self._depth + 1
        if depth == 1 and tag == "recipe":
            self._key, self._line = attributes.get("key", ""), self.parser.CurrentLineNumber
            self._fields = []
            self._report(*problems_of_key(self._key))
        elif depth == 2 and tag == "field":
            self._field(attributes)
        elif depth:
            meant = f"here stands {_MEANT[depth]}" if depth < len(_MEANT) else "nothing stands in a field"
            self._report(f"unexpected element <{tag[:100]}>; {meant}")

    def _field(self, attributes: dict[str, str]) -> None:
        name, word = attributes.get("name", ""), attributes.get("type")
        if word is None:
            found = [
                *problems_of_name(name),
                f'{name or "a field"} has no type; write one, as in type="DOUBLE"',
            ]
        else:
            found = [*problems_of_name(name), *problems_of_type(name, word)]
        self._report(*found)
        if word is not None and not found:
            self._fields.append(DeclaredField(name, DataType.from_word(word), self.parser.CurrentLineNumber))

    def _end(self, tag: str) -> None:
        self._depth -= 1
        if self._depth == 1 and tag == "recipe":
            self._problems += problems_of_repeats(self._fields)
            if not self._fields and not self._problems:
                self._report(f"the recipe {self._key!r} has no field; write one, as in {_MEANT[2]}")
            self.recipes.append(DeclaredRecipe(self._key, tuple(self._fields), self._line, self._name))

    def _text(self, text: str) -> None:
        if text.strip():
            self._report(f"unexpected text {text.strip()[:100]!r}; a field is written {_MEANT[2]}")
