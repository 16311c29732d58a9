"""What is logged, how it looks, and where it goes."""
