"""A Universal Robots controller to connect to: its RTDE interface, without a robot. Imports `gatewayd.rtde` only."""
