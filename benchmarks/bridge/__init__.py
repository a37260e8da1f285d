"""Throughput, latency and processor time of ``awarenav bridge``."""
