"""What routines of Logix controllers say of registers."""
