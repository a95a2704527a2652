"""Files that a surface file names, in its folder or below it: its buffers, such as those of a .gltf."""

from collections.abc import Callable
from pathlib import Path, PurePosixPath
from urllib.parse import unquote

from ..errors import MeshError
from .archive import Archive

Beside = Callable[[str], bytes]  # from the name that a file gives to another one to its content; raises MeshError


def in_folder(folder: Path, left: int) -> Beside:
    """Return the reader of files in a folder, of at most `left` bytes together."""

    def read(uri: str) -> bytes:
        nonlocal left
        path = folder / _plain(uri)
        if not path.is_file():
            raise MeshError(f"its arrays are in {uri!r:.60}, which is not beside it: put it there, or save it as .glb")
        try:
            with path.open("rb") as stream:
                data = stream.read(left + 1)
        except OSError as error:
            raise MeshError(f"{uri!r:.60} cannot be read ({error.strerror}): check its permissions") from None
        left -= len(data)
        if left < 0:
            raise MeshError("its arrays take more than the limit: decimate the surface or raise --max-faces")
        return data

    return read


def in_archive(archive: Archive, member: str) -> Beside:
    """Return the reader of files in the folder of a member of an archive."""
    return lambda uri: archive.read(str(PurePosixPath(member).parent / _plain(uri)))


def _plain(uri: str) -> str:
    """Return the relative path that a URI names. Raises MeshError for one that leads out of the folder."""
    name = unquote(uri)
    path = PurePosixPath(name)
    if not path.parts or path.is_absolute() or ".." in path.parts or any(sign in name for sign in ":\\\0"):
        raise MeshError(f"its arrays are in {uri!r:.60}, which is no file beside it: save it as .glb")
    return str(path)
