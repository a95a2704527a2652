"""Array files: atomic, without pickles, and refused with a reason."""

import errno
import hashlib
import io
import resource
import zipfile

import numpy as np
import pytest

from parameterize import files
from parameterize.files import load_arrays, save_arrays, save_bytes, save_text


def test_round_trip_is_exact(tmp_path):
    path = tmp_path / "a.npz"
    values = np.array([0.1, np.nextafter(1.0, 2.0), 1e-308])
    save_arrays(path, values=values, numbers=np.arange(3))
    data = load_arrays(path, ("values", "numbers"))
    np.testing.assert_array_equal(data["values"], values)
    assert data["numbers"].dtype == np.arange(3).dtype


def test_only_the_named_arrays_are_read(tmp_path):
    save_arrays(tmp_path / "a.npz", wanted=np.ones(2), other=np.zeros(2))
    assert list(load_arrays(tmp_path / "a.npz", ("wanted",))) == ["wanted"]


def test_equal_arrays_give_equal_files(tmp_path):
    for name in ("a.npz", "b.npz"):
        save_arrays(tmp_path / name, values=np.arange(5.0))
    digests = {hashlib.sha256((tmp_path / name).read_bytes()).hexdigest() for name in ("a.npz", "b.npz")}
    assert len(digests) == 1


def test_failed_write_leaves_the_old_file_and_no_litter(tmp_path, monkeypatch):
    path = tmp_path / "a.npz"
    save_arrays(path, values=np.ones(3))

    def fail(stream, *_, **__):
        stream.write(b"half a file")
        raise OSError(errno.ENOSPC, "disk full")

    monkeypatch.setattr(files.npy, "write_array", fail)
    with pytest.raises(OSError, match=r"disk full: .*/a\.npz'"):
        save_arrays(path, values=np.zeros(3))
    monkeypatch.undo()
    assert [p.name for p in tmp_path.iterdir()] == ["a.npz"]
    np.testing.assert_array_equal(load_arrays(path, ("values",))["values"], np.ones(3))


def test_a_full_disk_is_told_with_the_file(tmp_path):
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, hard))
    try:
        with pytest.raises(OSError) as bytes_error:
            save_bytes(tmp_path / "a.bin", bytes(100_000))
        with pytest.raises(OSError) as arrays_error:
            save_arrays(tmp_path / "a.npz", values=np.random.default_rng(0).random(100_000))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert [e.value.errno for e in (bytes_error, arrays_error)] == [errno.EFBIG] * 2
    assert bytes_error.value.filename == str(tmp_path / "a.bin")
    assert arrays_error.value.filename == str(tmp_path / "a.npz")
    assert not list(tmp_path.iterdir())


def test_text_replaces_what_was_there(tmp_path):
    path = tmp_path / "report.json"
    save_text(path, "{}")
    save_text(path, "conch \N{LATIN SMALL LETTER SHARP S}")
    assert path.read_text(encoding="utf-8") == "conch ß"
    save_text(path, "latin\udce9")
    assert path.read_text(encoding="utf-8") == "latin\\udce9"
    assert [p.name for p in tmp_path.iterdir()] == ["report.json"]


def test_missing_file(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"none\.npz: no such file"):
        load_arrays(tmp_path / "none.npz", ())


def test_missing_array_is_named(tmp_path):
    save_arrays(tmp_path / "a.npz", one=np.ones(1))
    with pytest.raises(ValueError, match=r"a\.npz: has no array named two, three"):
        load_arrays(tmp_path / "a.npz", ("one", "two", "three"))


class Bomb:
    """Unpickling this would be noticed."""

    def __reduce__(self):
        return (pytest.fail, ("a pickle was run",))


def test_pickled_content_is_refused_unread(tmp_path):
    path = tmp_path / "a.npz"
    np.savez(path, values=np.array([Bomb()], dtype=object))
    with pytest.raises(ValueError, match=r"a\.npz: .*allow_pickle"):
        load_arrays(path, ("values",))


def test_truncated_archive_is_refused(tmp_path):
    path = tmp_path / "a.npz"
    save_arrays(path, values=np.random.default_rng(0).random(1000))
    whole = path.read_bytes()
    for size in (0, 10, len(whole) // 2, len(whole) - 1):
        path.write_bytes(whole[:size])
        with pytest.raises(ValueError, match=r"a\.npz: not a readable \.npz archive"):
            load_arrays(path, ("values",))


def test_damaged_array_is_refused(tmp_path):
    path = tmp_path / "a.npz"
    save_arrays(path, values=np.random.default_rng(0).random(1000))
    content = bytearray(path.read_bytes())
    middle = len(content) // 2
    content[middle : middle + 50] = bytes(50)
    path.write_bytes(bytes(content))
    with pytest.raises(ValueError, match=r"a\.npz"):
        load_arrays(path, ("values",))


def test_a_header_of_another_python_says_nothing_of_its_own(tmp_path, recwarn):
    """NumPy warns of a header with an L behind a number; a refusal is one line, and a good file none."""
    np.savez(tmp_path / "a.npz", a=np.arange(3.0))
    with zipfile.ZipFile(tmp_path / "a.npz") as archive:
        content = archive.read("a.npy").replace(b"(3,), }", b"(3L,),}")
    with zipfile.ZipFile(tmp_path / "b.npz", "w") as archive:
        archive.writestr("a.npy", content)
    np.testing.assert_array_equal(load_arrays(tmp_path / "b.npz", ("a",))["a"], [0.0, 1.0, 2.0])
    assert not recwarn.list


def test_other_files_are_refused(tmp_path):
    path = tmp_path / "a.npz"
    path.write_text("v 0 0 0\n")
    with pytest.raises(ValueError, match="not a readable"):
        load_arrays(path, ())
    with pytest.raises(ValueError, match="not a readable"):
        load_arrays(tmp_path, ())


def test_archive_that_unpacks_to_too_much_is_refused(tmp_path, monkeypatch):
    path = tmp_path / "a.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("values.npy", bytes(10_000))
    monkeypatch.setattr(files, "MAX_UNPACKED_BYTES", 9_999)
    with pytest.raises(ValueError, match=r"a\.npz: unpacks to 10000 bytes"):
        load_arrays(path, ("values",))


def test_archives_are_limited_by_the_arrays_that_are_wanted(tmp_path, monkeypatch):
    save_arrays(tmp_path / "a.npz", wanted=np.ones(2), other=np.zeros(10_000))
    monkeypatch.setattr(files, "MAX_UNPACKED_BYTES", 9_999)
    np.testing.assert_array_equal(load_arrays(tmp_path / "a.npz", ("wanted",))["wanted"], np.ones(2))


@pytest.mark.parametrize("shape", [(2000, 2000, 2000, 3), (13,), (12, 0), (-1, -12), (10**30, 0)])
def test_a_header_that_does_not_match_the_data_is_refused_before_memory_is_taken(tmp_path, shape):
    path, member = tmp_path / "a.npz", io.BytesIO()
    np.lib.format.write_array_header_1_0(member, {"descr": "<f8", "fortran_order": False, "shape": shape})
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("values.npy", member.getvalue() + bytes(96))
    with pytest.raises(ValueError, match=r"a\.npz: not a readable \.npz archive"):
        load_arrays(path, ("values",))


def test_any_damaged_byte_is_refused_or_harmless(tmp_path):
    path, values = tmp_path / "a.npz", np.random.default_rng(1).random(20)
    save_arrays(path, values=values)
    whole = path.read_bytes()
    for place in range(len(whole)):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 0xFF]) + whole[place + 1 :])
        try:
            read = load_arrays(path, ("values",))["values"]
        except ValueError as error:
            assert str(error).startswith(f"{path}: ")
        else:
            np.testing.assert_array_equal(read, values)
