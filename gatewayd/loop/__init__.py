"""What every part of the process stands on: the clock, waits that show progress, and work in threads."""
