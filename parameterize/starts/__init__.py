"""The ways to a first map, one a file."""
