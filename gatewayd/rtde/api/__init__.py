"""The public asyncio API: a robot as a context manager, its packages as an iterator. `gatewayd.rtde` has the names."""
