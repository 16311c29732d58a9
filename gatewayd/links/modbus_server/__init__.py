"""A Modbus TCP server: units that show cells, on listeners that cells may share."""
