"""What is wrong? From this machine to the robot, and to the side of the PLC: found out by looking alone."""
