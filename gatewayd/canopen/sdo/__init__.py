"""SDO: the server through which a master reads and writes the object dictionary (CiA 301, 7.2.4)."""
