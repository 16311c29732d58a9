"""Devices: what the gateway talks to by itself, each as a link of its own under the name that the file gives it."""
