"""The tests of a mapping file, carried out with the core in simulated time: no link, no socket, no clock."""
