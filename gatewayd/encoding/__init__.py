"""Numbers on a wire: what the codecs of all protocols have in common. Pure; knows no protocol."""
