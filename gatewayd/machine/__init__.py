"""Thin looks at this machine: its routes, its ports, what this process may do. Nothing is changed by any of them."""
