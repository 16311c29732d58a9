"""A cell in words and tables, for people and programs."""
