"""The status listener: health, metrics, a JSON view of the cells, and one page to look at. Off unless asked for."""
