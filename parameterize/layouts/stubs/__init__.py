"""Thin handles on a fat body: where they begin and end, the body without them, and stubs for them on its faces."""
