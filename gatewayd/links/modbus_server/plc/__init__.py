"""What a PLC program needs of a Modbus unit: tags, code for its registers, the status block, the poll plan."""
