"""MQTT as a library: one connection to a broker, kept, bounded in every direction. It knows no cell.

The packets are those of paho-mqtt (extra `mqtt`), which `gatewayd.mqtt.engine` alone imports; the connection, its TLS
and its time are asyncio's.
"""
