"""Rules about brokers, topics and commands by MQTT."""
