"""Structured text (IEC 61131-3): the parts of a program as data, and what their bodies say in each dialect."""
