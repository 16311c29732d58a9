"""CANopen as a library: the services of a CiA 301 slave, pure and without a clock, and drivers for CAN buses."""
