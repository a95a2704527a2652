"""Defines the errors that the user's input causes, and puts them in one line."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from difflib import get_close_matches


class InputError(ValueError):
    """Say that an option, an input file or the output folder is at fault, in one line with the remedy.

    Examples
    --------
    >>> import iga_nn
    >>> try:
    ...     iga_nn.load_volume("nowhere.npz")
    ... except iga_nn.InputError as error:
    ...     print(error)
    nowhere.npz: no such file
    """


class TimeLimitError(Exception):
    """Say that the time limit of a run is reached before there is a result, and how to continue.

    Examples
    --------
    >>> import iga_nn
    >>> try:
    ...     iga_nn.run("poisson", "cube", "out", time_limit="0.001s")
    ... except iga_nn.TimeLimitError as error:
    ...     print(error)
    out: the time limit of 0.001 s is reached before there is a result; nothing was computed yet that could be resumed
    """


@contextmanager
def input_errors() -> Iterator[None]:
    """Turn ValueError and OSError of the block into InputError; the block must only read or check a user's input."""
    try:
        yield
    except (OSError, ValueError) as error:
        raise InputError(one_line(error)) from None


def expected_errors() -> tuple[type[Exception], ...]:
    """Return the exceptions that end a command with one line instead of a traceback."""
    from parameterize.surface.errors import MeshError
    from solve.diagnostics import ConvergenceError
    from solve.forms.parser import ExpressionError

    return InputError, TimeLimitError, MeshError, ExpressionError, ConvergenceError, OSError


def one_line(error: BaseException) -> str:
    """Return the message of an exception as one line; "path: reason" where the operating system refused."""
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    return " ".join(str(error).split())


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return the end of a message that proposes the known name nearest to a mistyped name; "" where none is near."""
    spelled = {each.casefold(): each for each in known}
    near = get_close_matches(name.casefold(), spelled, n=1)
    return f"; did you mean {spelled[near[0]]}?" if near else ""
