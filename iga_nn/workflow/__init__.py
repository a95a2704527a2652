"""Carries a run from the surface to the finished output folder."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager

LOGGERS = ("iga_nn", "parameterize", "solve")  # a run's log goes to these and those below them


@contextmanager
def logged(handler: logging.Handler, level: int = logging.NOTSET) -> Iterator[None]:
    """Give the log of what the block runs to a handler alone; NOTSET leaves the level as it is."""
    loggers = [logging.getLogger(name) for name in LOGGERS]
    before = [(logger.level, logger.propagate) for logger in loggers]
    for logger in loggers:
        logger.addHandler(handler)
        logger.setLevel(level or logger.level)
        logger.propagate = False
    try:
        yield
    finally:
        for logger, (old, propagate) in zip(loggers, before, strict=True):
            logger.removeHandler(handler)
            logger.setLevel(old)
            logger.propagate = propagate
