"""What the mapping language says of places in the Modbus areas, shared by the kinds of links that speak Modbus."""
