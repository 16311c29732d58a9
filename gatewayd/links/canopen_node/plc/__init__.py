"""What a PLC program needs of a CANopen node: tags, the content of its PDOs, the status words in them."""
