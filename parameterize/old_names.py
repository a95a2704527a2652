"""Knows the public names of earlier versions: each goes on working, with a warning that says what it is called now."""

import warnings
from collections.abc import Callable
from functools import wraps
from typing import Any, ParamSpec, TypeVar

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")

RENAMED = {  # a name of a package or a class -> its name now
    "iga_nn.MultiPatch": "Body",
    "parameterize.BodyCertificate": "Certificate",
    "parameterize.Parameterization.division": "decomposition",
    "solve.MultiPatchField": "BodyField",
    "solve.MultiPatchSolution": "Solution",
}
ORIGINS = {"extension": "sharp", "columns": "stacks"}  # of maps in report.json


def renamed(package: str, name: str) -> str:
    """Return the name that a package has now for one that it had, with a DeprecationWarning.

    Raises AttributeError for a name that the package never had.
    """
    now = RENAMED.get(f"{package}.{name}")
    if now is None:
        raise AttributeError(f"module {package!r} has no attribute {name!r}")
    warnings.warn(f"{package}.{name} is now called {package}.{now}", DeprecationWarning, stacklevel=3)
    return now


def takes_volume(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Let a function whose first argument is `body` take it by its earlier keyword, `volume`, with a warning.

    The function raises TypeError if both are given.
    """

    @wraps(function)
    def taking(*given: Any, **how: Any) -> Result:
        if "volume" in how:
            name = function.__name__
            if given or "body" in how:
                raise TypeError(f"{name}: volume is the earlier name of body, the first argument: give one of them")
            warnings.warn(f"{name}(volume=...) is now called {name}(body=...)", DeprecationWarning, stacklevel=2)
            given = (how.pop("volume"), *given)
        return function(*given, **how)

    return taking
