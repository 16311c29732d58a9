"""Two machines with a gateway each, their robot and their PLC, in network namespaces; keepalived moves the address."""
