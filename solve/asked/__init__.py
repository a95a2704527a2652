"""Answers what a user asks of a solution, each quantity with an interval."""
