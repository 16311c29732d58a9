"""The process data objects of a CiA 301 slave: parameters, content, transmission and reception."""
