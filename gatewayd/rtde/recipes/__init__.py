"""Recipe files of other RTDE clients: the XML of the Python client and the text of the C++ client, both ways.

recipes = read_recipes("record_configuration.xml")
names = recipes.recipe("out").names
"""

from gatewayd.rtde.recipes.declared import (
    DeclaredField,
    DeclaredRecipe,
    RecipeFile,
    RecipeFileError,
    RecipeProblem,
)
from gatewayd.rtde.recipes.doubts import doubts
from gatewayd.rtde.recipes.reading import parse_recipes, read_recipes
from gatewayd.rtde.recipes.writing import plain_text, xml_text

__all__ = [
    "DeclaredField",
    "DeclaredRecipe",
    "RecipeFile",
    "RecipeFileError",
    "RecipeProblem",
    "doubts",
    "parse_recipes",
    "plain_text",
    "read_recipes",
    "xml_text",
]
