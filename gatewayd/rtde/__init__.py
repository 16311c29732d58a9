"""RTDE, the Real-Time Data Exchange of Universal Robots controllers (TCP 30004)."""
