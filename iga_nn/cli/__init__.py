"""Runs the command line: commands, options, exit codes and progress."""
