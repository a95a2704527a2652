"""ZIP archives: their members within a limit, and the one surface that an archive may hold."""

import io
import zipfile
import zlib

from ..errors import MeshError
from .common import DAMAGED

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
