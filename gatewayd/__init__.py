"""gatewayd: the fieldbus registers of a Universal Robots controller on Modbus TCP, from one mapping file."""

from __future__ import annotations

__version__ = "0.1.0"
