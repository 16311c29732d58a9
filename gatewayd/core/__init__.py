"""What gatewayd knows and decides, without a socket and without a clock: time is a parameter."""
