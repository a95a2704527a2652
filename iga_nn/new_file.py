"""Checks the name of a file that a command writes, and writes it."""

from pathlib import Path

from parameterize.files import save_bytes

from .errors import InputError


def check_new(path: str | Path, ending: str, flag: str = "--out") -> Path:
    """Return the path of a file to write, given by an option. Raises InputError where no such file can be written."""
    target = Path(path)
    if target.is_dir() or not target.name:
        raise InputError(f"{target}: is a directory: name the file to write with {flag}")
    if target.suffix != ending:
        raise InputError(f"{target}: such files end in {ending}: choose another name with {flag}")
    if not target.parent.is_dir():
        raise InputError(
            f"{target}: cannot be written (there is no folder {target.parent}): make it, or choose another with {flag}"
        )
    return target


def save_new(target: Path, content: bytes, force: bool) -> None:
    """Write a file that does not exist or already has that content; replace other content only where `force`.

    Raises InputError where the file may not be replaced or cannot be written.
    """
    try:
        if not target.exists() or force:
            save_bytes(target, content)
        elif target.read_bytes() != content:
            raise InputError(f"{target}: exists; --force replaces it, --out names another file")
    except OSError as error:
        raise InputError(f"{target}: cannot be written ({error.strerror}): choose another with --out") from None
