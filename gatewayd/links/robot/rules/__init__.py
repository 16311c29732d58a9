"""Rules about the controller and its registers."""
