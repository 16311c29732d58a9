"""The write audit: who wrote what, when, old and new value, accepted or refused and why; and its file."""
