"""Writes the results of a run: report.json, report.html and tables."""
