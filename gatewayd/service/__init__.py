"""The process: cells and links put together, run, watched, reloaded and stopped."""
