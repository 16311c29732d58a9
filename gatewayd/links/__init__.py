"""How a cell meets the outside: one folder for each kind of link."""
