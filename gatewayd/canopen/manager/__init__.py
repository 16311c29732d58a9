"""A CANopen manager as a library: NMT master of the devices that belong to this gateway (CiA 302-2)."""
