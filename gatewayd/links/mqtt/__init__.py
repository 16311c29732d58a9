"""MQTT: the values of a cell to a broker that the plant has, and commands from it."""
