"""The demonstration: a simulated robot, the gateway and a small PLC program in one process, over real sockets."""
