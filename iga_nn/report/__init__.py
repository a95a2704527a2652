"""Writes what a run found: report.json, report.html and tables."""
