"""A CANopen node: a cell as the objects and PDOs of one device on a CAN bus."""
