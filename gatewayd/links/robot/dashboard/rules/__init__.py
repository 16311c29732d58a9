"""Rules GW85x: the dashboard server, its commands and its states."""
