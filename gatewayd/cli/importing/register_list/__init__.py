"""Register lists that people have, as mappings: text to cells, cells to places, places to lines of a mapping. Pure."""
