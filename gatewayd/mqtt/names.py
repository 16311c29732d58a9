"""What may stand in a topic (MQTT 3.1.1 and 5.0, 4.7), and what else makes trouble in one."""

from __future__ import annotations

from typing import Final

MAX_TOPIC: Final = 200
"""Characters of a topic that somebody writes down; MQTT would take 65,535 bytes."""
WILDCARDS: Final = "+#"


def fault_of(topic: str) -> str:
    """Why this is no topic to publish to, in words; empty: it is one."""
    if not topic or len(topic) > MAX_TOPIC:
        return f"it has {len(topic)} characters instead of 1 to {MAX_TOPIC}"
    wildcard = next((each for each in topic if each in WILDCARDS), None)
    if wildcard is not None:
        return f"`{wildcard}` is a wildcard of subscriptions"
    if topic.startswith("$"):
        return "topics that begin with `$` belong to the broker"
    if "" in topic.split("/"):
        return "it has an empty level: `/` stands between two levels only"
    if not topic.isprintable():
        return "it has a character that cannot be seen"
    return ""
