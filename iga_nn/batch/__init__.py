"""Runs many surfaces in worker processes, each into a folder of its own, and keeps one table."""
