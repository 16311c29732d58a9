"""The robot's program by its dashboard server: commands and states as variables, and the link that carries them."""
