"""The family of devices that answer Modbus requests, by TCP or on a serial line."""
