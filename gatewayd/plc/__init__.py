"""PLC programs, whatever link a PLC uses: types, names and structured text in the forms that tools import."""
