"""By which numbers masters know gatewayd's node. Light: the mapping language has them as defaults."""

from __future__ import annotations

VENDOR_ID = 0
"""No vendor-ID was assigned by CiA: 0 says so. Nobody else's is used."""
PRODUCT_CODE = 0x4757_4401
"""`GWD` and 1 for the product: a robot cell as one node."""
