"""The rules of `gatewayd check` about the language, ownership and what happens when a side is lost; `run` knows all."""
