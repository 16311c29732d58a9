"""A Universal Robots controller to connect to: its RTDE interface, without a robot. It stands on `gatewayd.rtde`."""
