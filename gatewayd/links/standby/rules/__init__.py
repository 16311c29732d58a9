"""Rules GW880 to GW889: what two gateways for one robot need."""
