from __future__ import annotations

import gzip
import os
from pathlib import Path

import pytest
from mesh_files import ball, joined, obj

from iga_nn.batch.surfaces import distinct_folders, divided, entries_of
from iga_nn.errors import InputError
from iga_nn.models import in_set


@pytest.fixture
def parts(in_folder):
    Path("parts/deep").mkdir(parents=True)
    for name in ("b.obj", "a.stl", "notes.txt", ".hidden.obj", "deep/c.PLY", "[1].obj"):
        Path("parts", name).write_text(obj())
    Path("parts/d.obj.gz").write_bytes(gzip.compress(obj().encode()))
    return in_folder


def names(*given):
    return [entry.name for entry in entries_of(given, Path("out"))]


def test_files_folders_patterns_and_names_in_their_order(parts):
    assert names("parts") == ["parts/[1].obj", "parts/a.stl", "parts/b.obj", "parts/d.obj.gz"]
    assert names("parts/**/*.PLY", "bean", "parts/[1].obj") == ["parts/deep/c.PLY", "bean", "parts/[1].obj"]
    assert names("parts/*.txt") == ["parts/notes.txt"]  # a pattern is taken at its word
    assert names("g1") == in_set() and "bunny" in in_set()
    assert names("nowhere.obj") == ["nowhere.obj"]  # refused when it is run, the others go on


def test_files_have_absolute_paths_and_names_stay(parts):
    file, sample = entries_of(["parts/b.obj", "bean"], Path("out"))
    assert file.mesh == str(parts / "parts" / "b.obj") and file.folder == parts / "out" / "b"
    assert sample.mesh == "bean" and sample.folder == parts / "out" / "bean"


def test_each_surface_is_taken_once(parts):
    Path("link.obj").symlink_to(parts / "parts" / "b.obj")
    assert names("parts/b.obj", "./parts/b.obj", "bean", "link.obj", "bean") == ["parts/b.obj", "bean"]
    (link,) = entries_of(["link.obj", "parts/b.obj"], Path("out"))
    assert link.folder.name == "link"  # not what it leads to


@pytest.mark.parametrize("given", ["parts/deep/empty", "parts/*.vtu", ""])
def test_what_names_no_surface(parts, given):
    Path("parts/deep/empty").mkdir()
    if given:
        with pytest.raises(InputError, match=r"holds no surface|no file matches"):
            names("bean", given)
    with pytest.raises(InputError, match="no surface is named"):
        entries_of([], Path("out"))


@pytest.mark.parametrize(
    ("meshes", "folders"),
    [
        (["/x/a.obj", "/x/b.obj", "bean"], ["a", "b", "bean"]),
        (["/x/a.obj", "/x/a.stl", "/x/b.obj"], ["a.obj", "a.stl", "b"]),
        (["/x/part.v1.obj", "/x/part.v2.obj"], ["part.v1.obj", "part.v2.obj"]),
        (["/x/left/a.obj", "/x/right/a.obj"], ["left_a.obj", "right_a.obj"]),
        (["/x/l/p/a.obj", "/y/l/p/a.obj", "/x/l/p/a.stl"], ["x_l_p_a.obj", "y_l_p_a.obj", "a.stl"]),
        (["/x/A.obj", "/x/a.obj"], ["x_A.obj", "x_a.obj-2"]),
        (["bean", "/x/bean.obj"], ["bean", "bean.obj"]),
        (["/a/b_c.obj", "/a_b/c.obj", "/x/b_c.stl", "/x/c.stl"], ["b_c.obj", "c.obj", "b_c.stl", "c.stl"]),
    ],
)
def test_names_that_collide_are_told_apart(meshes, folders):
    assert distinct_folders(meshes) == folders
    assert len({name.casefold() for name in distinct_folders(meshes)}) == len(meshes)


def test_odd_names(in_folder):
    odd = ["a b.obj", "é ü.obj", "-dash.obj", "100%#?.obj", "line\nbreak.obj", os.fsdecode(b"latin\xe9.obj")]
    for name in odd:
        Path(name).write_text(obj())
    found = entries_of(odd, Path("out"))
    assert [entry.folder.name for entry in found] == [name.removesuffix(".obj") for name in odd]
    assert [entry.name for entry in found[-2:]] == ["line\\nbreak.obj", "latin\\udce9.obj"]  # written everywhere


def test_each_body_of_a_file_has_an_entry_of_its_own(in_folder):
    Path("pair.obj").write_text(obj(*joined(ball(2.0), ball(), ball(subdivisions=1, center=(5, 0, 0)))))
    Path("pair-2.obj").write_text(obj())
    Path("none.obj").write_text("hello\n")
    found = divided(entries_of(["pair.obj", "pair-2.obj", "none.obj", "bean"], Path("out")), 1000)
    assert [(entry.name, entry.folder.name, number) for entry, number in found] == [
        ("pair.obj-0", "pair-0", 0),
        ("pair.obj-2", "pair-2", 2),
        ("pair-2.obj", "pair-2-2", None),
        ("none.obj", "none", None),
        ("bean", "bean", None),
    ]
