"""ZIP archives, and files beside a surface that it names, such as the buffers of a .gltf; all within a limit."""

import io
import zipfile
import zlib
from pathlib import Path, PurePosixPath
from urllib.parse import unquote

from ..errors import MeshError
from .common import DAMAGED, Beside

MOST_MEMBERS = 10_000


class Archive:
    """The members of a ZIP archive in memory, none of which is written to the disk.

    left: bytes that members may unpack to, all together.
    """

    def __init__(self, data: bytes, left: int) -> None:
        try:
            self._archive = zipfile.ZipFile(io.BytesIO(data))
            self.names = [name for name in self._archive.namelist() if name and not name.endswith("/")]
        except (zipfile.BadZipFile, ValueError, OSError, NotImplementedError) as error:
            raise MeshError(f"not a whole archive ({error}); {DAMAGED}") from None
        if len(self.names) > MOST_MEMBERS:
            raise MeshError(f"the archive holds {len(self.names)} files: take out the surface and name it")
        self._left = left

    def read(self, name: str) -> bytes:
        """Return the content of a member."""
        try:
            with self._archive.open(name) as stream:
                data = stream.read(self._left + 1)
        except (KeyError, zipfile.BadZipFile, zlib.error, EOFError, OSError, ValueError) as error:
            said = "it is missing" if isinstance(error, KeyError) else " ".join(str(error).split())[:80]
            raise MeshError(f"{name!r:.60} of the archive cannot be unpacked ({said}); {DAMAGED}") from None
        except (RuntimeError, NotImplementedError) as error:
            raise MeshError(f"{name!r:.60} of the archive cannot be unpacked ({error}): unpack it yourself") from None
        if len(data) > self._left:
            raise MeshError("the archive unpacks to more than the limit: decimate the surface or raise --max-faces")
        self._left -= len(data)
        return data

    def only(self, endings: tuple[str, ...]) -> str:
        """Return the name of the only member with one of these endings; hidden ones do not count."""
        found = [name for name in self.names if name.lower().endswith(endings) and not _is_hidden(name)]
        if len(found) != 1:
            held = ", ".join(map(repr, (found or self.names)[:3])) or "nothing"
            raise MeshError(f"the archive holds {len(found)} surfaces ({held:.200}): unpack it and name one")
        return found[0]


def _is_hidden(name: str) -> bool:
    parts = name.replace("\\", "/").split("/")
    return parts[-1].startswith(".") or "__MACOSX" in parts


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
