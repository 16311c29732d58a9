"""Rules about the node, its bus and its PDOs."""
