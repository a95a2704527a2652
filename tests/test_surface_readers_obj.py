"""Files of vertices and triangles alone are read at once, to the same content as all others."""

import pytest

from parameterize.surface.readers import obj
from parameterize.surface.readers.common import SurfaceFile

VERTICES = "v 0 0 0\nv 1.5 -2e-3 .25\n# corner\nv 0 1 0\n\nv +0.1 0 1E2\n"
FACES = "f 1 2 3\nf 4 3 2\nf 1 4 2\nf 3 4 1"


def read(text):
    return obj.read_obj(SurfaceFile(text.encode(), 100, lambda name: b""))


@pytest.mark.parametrize("ends", ["\n", "\r\n", ""])
def test_plain_files_have_the_content_of_all_others(ends, monkeypatch):
    text = (VERTICES + FACES).replace("\n", ends or "\n") + ends
    plain = read(text)
    assert obj._plain(obj.text_lines(text.encode())) is not None
    monkeypatch.setattr(obj, "_plain", lambda lines: None)
    general = read(text)
    assert plain.vertices.tobytes() == general.vertices.tobytes()
    assert [list(row) for row in plain.polygons] == general.polygons
    assert plain.notices == general.notices == () and plain.groups == general.groups == {}


@pytest.mark.parametrize(
    "line", ["f 1 2 5", "f 1 2 3 4", "f 1/1 2/2 3/3", "f -1 -2 -3", "f 0 1 2", "v 1 2", "g part", "v 1 2 3 4", "f 1 2"]
)
def test_other_files_are_not_read_at_once(line):
    assert obj._plain(obj.text_lines((VERTICES + FACES + "\n" + line + "\n").encode())) is None
