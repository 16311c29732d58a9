"""Packets of a broker in a trace."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from gatewayd.links.registry import decoder_of

PUBLISH = b"\x30\x08\x00\x03a/b\x1b[m"


def test_packets_in_words_whole_or_in_pieces() -> None:
    decoder = decoder_of("mqtt")
    assert decoder.words(PUBLISH + b"\xc0\x00", "b:1", outgoing=True) == "PUBLISH a/b: 1b 5b 6d; PINGREQ"
    assert decoder.words(PUBLISH[:4], "b:1", outgoing=False) == "4 bytes of a packet"
    assert decoder.words(PUBLISH[4:], "b:1", outgoing=False) == "PUBLISH a/b: 1b 5b 6d"
    assert "not MQTT" in decoder.words(b"\xff" * 8, "b:1", outgoing=False)
    assert decoder.words(b"\xd0\x00", "b:1", outgoing=False) == "PINGRESP"


@given(st.lists(st.binary(min_size=1, max_size=60), max_size=5))
def test_any_bytes(pieces: list[bytes]) -> None:
    decoder = decoder_of("mqtt")
    for piece in pieces:
        assert decoder.words(piece, "b:1", outgoing=False).isprintable()
