"""Sparkplug B 3.0 as a library: payloads, topics, and an edge node as a state machine.

Pure: it has no socket, no MQTT client and no clock, and knows no cell. The owner of the connection to a broker hands in
what arrives and sends what comes out. The identifiers `tck-id-...` in it are those of the specification, Eclipse
Sparkplug 3.0.0.
"""
