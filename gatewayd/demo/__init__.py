"""The demonstration: a simulated robot, the gateway, a PLC program and an I/O island in one process, over sockets."""
