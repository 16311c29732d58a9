"""What gatewayd knows and decides, without a socket and without a clock: every function that needs the time takes it."""
