"""Rules about registers, units and listeners."""
