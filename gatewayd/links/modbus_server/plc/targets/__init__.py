"""The engineering tools for which files are written: one module for each, all made from the same model."""
