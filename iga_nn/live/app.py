"""Checks the options of the live page, `iga-nn app`, and that its packages are installed; then serves it."""

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from ..errors import InputError, input_errors
from ..options import MapOptions, ProblemOptions

INSTALL = "pip install 'iga-nn[app]'"


def serve(
    say: Callable[[str], None],
    *,
    port: int,
    open_browser: bool,
    max_upload: int,
    mapping: MapOptions,
    problem_options: ProblemOptions,
) -> None:
    """Serve the page until interrupted. say: receives the address. max_upload: in megabytes.

    Raises InputError for options that cannot be run, where trame is missing and where the port is taken.
    """
    if not 0 <= port <= 65_535:
        raise InputError(f"port {port}: must lie between 0, for any free one, and 65535")
    if max_upload < 1:
        raise InputError(f"max upload {max_upload}: must be at least 1 megabyte")
    mapping.config()
    problem_options.check_law()
    try:
        from .server import Page
    except ModuleNotFoundError as error:
        package = (error.name or "trame").partition(".")[0]
        raise InputError(f"the live page needs {package}, which is not installed: {INSTALL}") from None
    with TemporaryDirectory(prefix="iga-nn-") as root, input_errors():
        Page(Path(root), max_upload, mapping, problem_options).run(say, port, open_browser)
