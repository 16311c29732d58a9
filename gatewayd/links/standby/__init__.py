"""Two gateways for one robot, and which of them serves the cell. The robot's own claim is the lock."""
