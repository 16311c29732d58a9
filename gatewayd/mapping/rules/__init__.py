"""The rules of `gatewayd check`, one module per family; `run` knows them all.

This package imports nothing itself, so that the loader can use `rules.syntax` alone.
"""

from __future__ import annotations
