"""Carries a run from the surface to the finished output folder."""

LOGGERS = ("iga_nn", "parameterize", "solve")  # a run's log goes to these and those below them
