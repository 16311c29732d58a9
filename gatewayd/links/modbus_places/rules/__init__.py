"""Rules about places in Modbus areas, whichever kind of link has them."""
