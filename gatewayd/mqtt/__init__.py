"""MQTT as a library: one connection to a broker, kept, bounded in every direction. It knows no cell.

The packets of 3.1.1 and 5.0 are its own (`engine`), because a client library brings its own sockets, threads and
queues, which cannot be bounded from outside; the connection, its TLS and its time are asyncio's.
"""
