"""CANopen devices: nodes that a manager of this gateway boots, watches and exchanges PDOs with."""
