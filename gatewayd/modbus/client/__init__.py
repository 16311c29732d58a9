"""A Modbus client for many units at once: polls, writes on change, and units that are lost without harm to others.

It knows no cell and no link. What has no socket comes first; time is a parameter there:

- `requests`: a request, and what its answer says or why there is none. `pdus` makes the bytes (pymodbus).
- `framing`: Modbus TCP and RTU around a PDU. `timing`: the silences of a serial line.
- `grouping`: wanted items -> the requests that read them.
- `breaker`: whether a unit is asked at all. `identity`: which device it is.
- `station`: one unit, with its polls, its writes and its counters.
- `conversation`: the requests that are on their way on one connection.
- `line`: the stations that share a connection, and whose turn it is.

`tcp` and `serial` have the sockets and ports: `TcpLine` and `SerialLine` run a `Line` until they are cancelled.
"""
