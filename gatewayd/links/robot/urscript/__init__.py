"""What the robot program has of a mapping, in URScript: accessors, watchdog, handshakes, self test."""
