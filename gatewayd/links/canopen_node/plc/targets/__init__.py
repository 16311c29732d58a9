"""The engineering tools for whose CANopen masters files are written: a module for each, made from the same model."""
