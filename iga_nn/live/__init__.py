"""Serves the live page, which runs jobs in a queue and shows them in the browser."""
