"""The local control interface: HTTP and JSON over a Unix socket, its views of the cells, and its client."""
