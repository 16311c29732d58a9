"""Modbus TCP: the mapped variables as coils, discrete inputs, input registers and holding registers."""
