"""A mutation fuzzer over everything that reads a file or a formula: no traceback, no hang, no growth beyond 2 GB.

    python tests/fuzzing.py --files 100000 --seed 0

Small files made by code are cut off at every place, then spoiled at random: bits, words, counts, pieces of one another.
What may come out is what the command line turns into exit code 2, as one line that names the file. Each reader runs in
a process of its own, which is watched; file k of a reader follows from the seed and k alone. What failed is saved.
"""

from __future__ import annotations

import argparse
import gzip
import io
import json
import logging
import multiprocessing
import os
import re
import resource
import sys
import tempfile
import time
import traceback
import warnings
import zipfile
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass, replace
from functools import cache, partial
from importlib.util import find_spec
from pathlib import Path

import formulas
import meshio
import numpy as np
import pyvista
import threemf_files
from bodies import exact_ring
from foreign_files import geopdes, geopdes_07, mfem_patches
from gltf_files import moved
from mesh_files import (
    CUBE,
    MIXED,
    QUADS,
    TETRAHEDRON,
    TRIANGLES,
    ball,
    binary_stl,
    flagged_ply,
    medit,
    obj,
    off,
    ply,
    text_stl,
)
from reader_files import Ply, beside, faces, grid, msh2, msh2_binary, msh41, msh41_binary, save, vertices
from scene_files import glb, gltf, model, solid_model, threemf, zipped
from step_files import crowded
from vtkmodules.vtkIOLegacy import vtkUnstructuredGridWriter

from iga_nn.errors import InputError, input_errors, one_line
from iga_nn.io import gismo, mfem_writer
from iga_nn.io import splinepy as spline_files
from iga_nn.io.beginnings import is_volume
from iga_nn.io.formats import load_volume
from iga_nn.models import resolve
from iga_nn.samples import sample
from iga_nn.workflow.mapping import read_corners
from iga_nn.workflow.verdict import certified_facts
from parameterize.checkpoint import Checkpoints
from parameterize.cube.boundary_map import BoundaryMap
from parameterize.run import corner_vertices
from parameterize.spline.body import Body
from parameterize.spline.volume import BSplineVolume
from parameterize.surface.surface import MeshError
from solve.field import SplineField
from solve.forms.frame import UnitFrame
from solve.forms.parser import Expression, ExpressionError
from solve.study import benchmark_volume

OUTCOMES = ("accepted", "refused", "crashed", "slow")
SECONDS = 20  # for one file; the processor's
MEMORY = 2 << 30  # bytes a reader may grow by
ADDRESSES = 16 << 30  # bytes of address space, so that a failing reader does not take the machine along

REFUSALS = (InputError, MeshError, ExpressionError, OSError)  # exit code 2: as in iga_nn.cli.commands.main
SCRATCH = "/dev/shm"  # noqa: S108 - 200 000 files are written to memory where that is possible

Pieces = list[bytes]


@dataclass(frozen=True)
class Reader:
    """One kind of file.

    read: called with a path, as the command line does it. seeds: good files, each in the pieces that `pack` makes a
    file of: spoiling a piece gets past the checksum of the whole. packed: also as .gz. share: of the files that another
    reader gets, for one that takes seconds a file.
    """

    name: str
    suffix: str
    read: Callable[[Path], None]
    seeds: tuple[Pieces, ...]
    pack: Callable[[Pieces], bytes] = b"".join
    packed: bool = False
    share: float = 1.0


# Spoiling: each takes the random numbers and some bytes, and gives other bytes.

NUMBERS = (0, 1, 2, 3, 127, 255, 256, 65535, 2**31 - 1, 2**31, 2**32 - 1, 2**63 - 1, 2**63, 2**64 - 1, 10**9)
WORDS = [str(n).encode() for n in (*NUMBERS, -1, -2, -(2**31), 10**18, 10**40, "9" * 5000)]
WORDS += [
    b"nan",
    b"inf",
    b"-inf",
    b"1e308",
    b"-1e308",
    b"1e-320",
    b"1e999",
    b"0x10",
    b"1_000",
    b"0.5",
    b"-1.5",
    b"1e-9",
    b".",
    b"-",
    b"",
    b"\0",
]
WORDS += [
    b"x",
    b"'",
    b'"',
    b"<",
    b"[",
    b"]",
    b"{}",
    b"null",
    b"true",
    b"(((((",
    b"**",
    b"/0",
    b"\n",
    b"\xff\xfe",
    b"\xc3",
]
WORD = re.compile(rb"[-+.\w]+")


def cut_off(rng, data):
    return data[: rng.integers(len(data) + 1)]


def flip_bits(rng, data):
    spoiled = bytearray(data)
    for place in rng.integers(len(data), size=rng.integers(1, 9)):
        spoiled[place] ^= 1 << rng.integers(8)
    return bytes(spoiled)


def another_word(rng, data):
    words = list(WORD.finditer(data))
    if not words:
        return data
    word = words[rng.integers(len(words))]
    return data[: word.start()] + WORDS[rng.integers(len(WORDS))] + data[word.end() :]


def another_digit(rng, data):
    """The mildest: most such files are read to the end."""
    places = [match.start() for match in re.finditer(rb"\d", data)]
    if not places:
        return data
    place = places[rng.integers(len(places))]
    return data[:place] + b"%d" % rng.integers(10) + data[place + 1 :]


def another_number(rng, data):
    """A count in binary, at any place."""
    number = NUMBERS[rng.integers(len(NUMBERS))].to_bytes(8, ["little", "big"][rng.integers(2)])
    size = int(rng.choice([1, 2, 4, 8]))
    place = rng.integers(len(data))
    return data[:place] + (number[:size] if rng.integers(2) else number[-size:]) + data[place + size :]


def cut_out(rng, data):
    first, last = sorted(rng.integers(len(data) + 1, size=2))
    return data[:first] + data[min(last, first + 200) :]


def twice(rng, data):
    first, last = sorted(rng.integers(len(data) + 1, size=2))
    return data[:last] + data[first:]


def rows_moved(rng, data):
    rows = data.split(b"\n")
    i, j = rng.integers(len(rows), size=2)
    rows[i], rows[j] = rows[j], rows[i]
    return b"\n".join(rows)


def garbage(rng, data):
    place = rng.integers(len(data) + 1)
    return data[:place] + rng.bytes(rng.integers(1, 20)) + data[place:]


def splice(rng, data):
    """Begins as this one, ends as another."""
    other = whole_files()[rng.integers(len(whole_files()))]
    return data[: rng.integers(len(data) + 1)] + other[rng.integers(len(other) + 1) :]


SPOILERS = (another_digit, another_digit, another_word, another_word, another_number, flip_bits)
SPOILERS += (cut_off, cut_out, twice, rows_moved, garbage, splice)


def spoil(rng, data):
    for _ in range(rng.choice([1, 1, 1, 2, 4])):
        if data:
            data = SPOILERS[rng.integers(len(SPOILERS))](rng, data)
    return data


def spoiled(reader, rng):
    """A random bad file of a reader: suffix and content."""
    pieces = list(reader.seeds[rng.integers(len(reader.seeds))])
    inside = rng.random() < 0.6
    if inside:
        k = rng.integers(len(pieces))
        pieces[k] = spoil(rng, pieces[k])
    content = reader.pack(pieces)
    if reader.packed and rng.random() < 0.1:
        content = gzip.compress(content, compresslevel=1, mtime=0)
        return f"{reader.suffix}.gz", content if inside else spoil(rng, content)
    return reader.suffix, content if inside else spoil(rng, content)


def file_of(reader, seed, number, count):
    """File `number` of `count`: up to half are the first seed cut off, at every place if they suffice; then random."""
    whole = reader.pack(reader.seeds[0])
    if number < min(len(whole), count // 2):
        return reader.suffix, whole[: number * len(whole) // min(len(whole), count // 2)]
    return spoiled(reader, np.random.default_rng([seed, zlib.crc32(reader.name.encode()), number]))


# Reading, as the command line does it.


def check(path):
    """What `iga-nn check` does."""
    if is_volume(path):
        certified_facts(load_volume(path))
    else:
        resolve(str(path)).summary()


def read_volume(path):
    """What every command does first with a volume; of one patch, `iga-nn check` does the rest."""
    notices = logging.getLogger("iga_nn.io")
    level = notices.level
    notices.setLevel(logging.ERROR)  # notices are no errors
    try:
        body = load_volume(path)
    finally:
        notices.setLevel(level)
    if isinstance(body, BSplineVolume):
        certified_facts(body)


def given(read):
    """The same for a file that the command line is given beside its input."""

    def checked(path):
        with input_errors():
            read(path)

    return checked


def read_formula(path):
    """A formula as the shell hands it over, with its derivatives."""
    try:
        expression = Expression(os.fsdecode(path.read_bytes())).placed(UnitFrame((0.5, 0.0, 0.0), 2.0))
    except ExpressionError as error:
        raise InputError(f"{path}: {error}") from None
    points = np.linspace(-1.0, 2.0, 12).reshape(3, 4)
    value, gradient, hessian = formulas.hessian(expression, *points)
    assert value.shape == (4,) and gradient.shape == (3, 4) and hessian.shape == (6, 4)


IDENTITY = {"surface": "abc", "seed": 0, "config": {"steps": [1, 2]}}


def read_checkpoint(path):
    Checkpoints(path.parent, IDENTITY, resume=True).load(path.stem)


def read_corners_of_cube(path):
    corner_vertices(cube(), read_corners(path))


@cache
def cube():
    return sample("cube")


# Good files.


def written(write, suffix):
    """The bytes that `write` puts into a file of that suffix."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, f"file{suffix}")
        write(path)
        return path.read_bytes()


def bent(n, degree):
    grid = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, n)] * 3, indexing="ij"), axis=-1)
    return BSplineVolume.uniform(grid + 0.05 * np.sin(3.0 * np.roll(grid, 1, axis=3)), degree)


def glued(n, degree):
    """Two patches; the second has u and v exchanged, and w reversed."""
    first = bent(n, degree)
    points = first.control_points
    shifted = points + (points[-1:] - points[:1])
    shifted[0] = points[-1]
    second = BSplineVolume.uniform(shifted.transpose(1, 0, 2, 3)[:, :, ::-1], degree)
    return Body.from_patches([first, second])


def field_on(volume, coefficients):
    return SplineField(volume.degrees, volume.knots, coefficients)


def surface_reader(name, suffix, *seeds):
    contents = tuple([seed.encode() if isinstance(seed, str) else seed] for seed in seeds)
    return Reader(name, suffix, check, contents, packed=True)


def meshio_reader(name, suffix, *options):
    """Tetrahedra, and quadrangles."""
    tetrahedra = np.array([[0, 1, 2, 4], [1, 3, 2, 7], [1, 4, 7, 5], [2, 7, 4, 6], [1, 2, 7, 4]])
    meshes = [meshio.Mesh(CUBE, [("tetra", tetrahedra)]), meshio.Mesh(CUBE, [("quad", np.array(QUADS))])]
    seeds = [written(partial(meshio.write, mesh=mesh, **chosen), suffix) for chosen in options for mesh in meshes]
    return surface_reader(name, suffix, *seeds)


FORMS = ("ascii", "binary_little_endian", "binary_big_endian")


def any_plies():
    """Properties beside the corners, lists on vertices, triangle strips, other elements."""
    flags = ["uchar flags", "list char float more"]
    yield Ply(("edge", ["int a"], [(0,)]), vertices(), beside(faces(), after=flags, values_after=[7, (0.5,)]))
    yield Ply(beside(vertices(), before=["list short double w"], values_before=[(1.0,)]), faces())
    strips = [((0, 1, 4, 5, 6, 7, 2, 3, 0, 1, -1, 0, 4, 2, 6),)]
    yield Ply(vertices(), ("tristrips", ["list int int vertex_index"], strips), faces(TRIANGLES[10:]))


PHYSICAL = '$PhysicalNames\n1\n2 5 "lid"\n$EndPhysicalNames\n'
PHYSICAL += "$Entities\n0 0 1 0\n1 0 0 0 1 1 1 1 5 0\n$EndEntities\n"


def any_mshs():
    """Parametric nodes, version 4.0, either byte order."""
    yield from (msh2(more=PHYSICAL), msh41(parametric=1), msh41(parametric=1, version="4"))
    yield msh41().replace("$Nodes", f"{PHYSICAL}$Nodes", 1)
    yield from (write(order, 1) for write in (msh2_binary, msh41_binary) for order in "<>")


def vtk_files():
    """Cells of several kinds in every encoding that VTK writes."""
    cells = [(12, [0, 1, 3, 2, 4, 5, 7, 6]), *((9, quad) for quad in QUADS), (6, [0, 1, 2, 3]), (3, [0, 1])]
    mesh = grid(cells)
    mesh.cell_data["part"] = np.arange(len(cells)) // 3
    for mode, packing in (("ascii", None), ("binary", "LZMA"), ("appended", "ZLib"), ("appended", "LZ4")):
        for order, header in (("little", 32), ("big", 64)):
            yield written(partial(save, mesh, mode=mode, compressor=packing, order=order, header=header), ".vtu")


def vtk_polygons(suffix):
    """Polygons, strips and lines by VTK's own writers."""
    mesh = pyvista.PolyData.from_regular_faces(CUBE, np.array(QUADS))
    mesh.cell_data["part"] = np.arange(len(QUADS)) // 2
    for binary in (False, True):
        yield written(partial(mesh.save, binary=binary), suffix)
    strips = [[1, 0, 3, 2], [4, 5, 6, 7], [0, 1, 4, 5], [3, 2, 7, 6], [0, 4, 2, 6], [1, 3, 5, 7]]
    strip = pyvista.PolyData(CUBE, strips=np.ravel([[4, *row] for row in strips]), lines=[2, 0, 1])
    yield written(partial(strip.save, binary=True), suffix)


def legacy_vtks():
    """Polygons of version 5.1; cells of version 4.2, whose lists begin with their lengths."""
    yield from vtk_polygons(".vtk")
    mesh = grid([(12, [0, 1, 3, 2, 4, 5, 7, 6]), *((9, quad) for quad in QUADS), (3, [0, 1])])
    mesh.cell_data["part"] = np.arange(mesh.n_cells)
    for kind in (1, 2):

        def write(path, kind=kind):
            writer = vtkUnstructuredGridWriter()
            writer.SetInputData(mesh)
            writer.SetFileVersion(42)
            writer.SetFileType(kind)
            writer.SetFileName(str(path))
            writer.Write()

        yield written(write, ".vtk")


def scene_readers():
    """The pieces are what an archive or a .glb holds, so that spoiled ones get past its checksums."""
    nodes = [{"children": [1], "rotation": [0.5, 0.5, 0.5, 0.5]}, {"mesh": 0, "name": "a", "scale": [2, 1, 1]}]
    yield Reader("glb", ".glb", check, (list(gltf()), list(gltf(nodes=nodes))), glb, packed=True)
    yield Reader("glb, moved", ".glb", check, tuple(list(boxes.pieces()) for boxes in moved()), glb)
    yield surface_reader("gltf", ".gltf", gltf(inside=False)[0])
    beside = list(gltf(beside="a.bin"))
    yield Reader(
        "gltf, beside", ".zip", check, (beside,), lambda both: zipped(dict(zip(("a.gltf", "a.bin"), both, strict=True)))
    )
    yield Reader("3mf", ".3mf", check, ([model()],), lambda pieces: threemf(pieces[0]))
    yield Reader(
        "3mf, parts",
        ".3mf",
        check,
        ([piece.encode() for piece in threemf_files.PIECES.values()],),
        lambda pieces: threemf_files.archive(dict(zip(threemf_files.PIECES, pieces, strict=True))),
    )
    yield Reader("3mf, bytes", ".3mf", check, ([threemf_files.package()],))
    yield Reader("zip", ".zip", check, ([obj().encode()],), lambda pieces: zipped({"a/cube.obj": pieces[0]}))
    yield Reader("zip, bytes", ".zip", check, ([zipped({"cube.stl": binary_stl(), "b.txt": "b"})],))
    for suffix in (".step", ".iges"):
        if found := solid_model(suffix[1:]):
            pieces = ([found], [crowded()]) if suffix == ".step" else ([found],)
            yield Reader(suffix[1:], suffix, check, pieces, share=0.1)


def npz_reader(name, read, *things):
    """The arrays are the pieces: spoiled, they are packed again with the right checksums."""
    archives = [zipfile.ZipFile(io.BytesIO(written(thing.save, ".npz"))) for thing in things]
    names = archives[0].namelist()

    def pack(pieces):
        stream = io.BytesIO()
        with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
            for member, content in zip(names, pieces, strict=True):
                archive.writestr(zipfile.ZipInfo(member), content)
        return stream.getvalue()

    return Reader(name, ".npz", read, tuple([a.read(member) for member in names] for a in archives), pack)


def checkpoint_reader():
    """Header and arrays are the pieces, the header's length goes before them."""

    def save(path):
        arrays = {"now.weight": np.arange(12.0).reshape(3, 4), "adam.0.step": np.array(3.0)}
        state = {"number": 1, "step": 7, "best_key": [0, 0.5], "corners": None, "history": [["S(2)", 0, 1.0, 0, {}]]}
        Checkpoints(path.parent, IDENTITY, resume=True).save(path.stem, arrays, state)

    content = written(save, ".safetensors")
    start = 8 + int.from_bytes(content[:8], "little")

    def pack(pieces):
        return len(pieces[0]).to_bytes(8, "little") + b"".join(pieces)

    return Reader("checkpoint", ".safetensors", given(read_checkpoint), ([content[8:start], content[start:]],), pack)


def foreign_readers():
    """Files of other programs, of one patch and of several; JSON where the package that reads it is installed."""
    volumes = [bent(3, 1), bent(3, 2), glued(3, 2), exact_ring()]
    formats = {"gismo": (".xml", gismo.write_gismo), "mfem": (".mesh", mfem_writer.write_mfem)}
    if find_spec("splinepy") is not None:
        formats["json"] = (".json", spline_files.write_json)
    for kind, (suffix, write) in formats.items():
        seeds = [[written(lambda path, v=v, write=write: write(path, v), suffix)] for v in volumes]
        yield Reader(kind, suffix, read_volume, tuple(seeds))
    yield Reader("mfem, patches", ".mesh", read_volume, ([mfem_patches().encode()],))
    yield Reader(
        "geopdes",
        ".txt",
        read_volume,
        ([geopdes(volumes[2]).encode()], [geopdes_07(volumes[0]).encode()], [geopdes(volumes[3]).encode()]),
    )


FORMULAS = ("exp(x+z)*sin(y)", "1e-3*(x**2-y)/(2+z)-3.5", "-tanh(x*y)**(1/3)+abs(log(z))*pi", "sqrt(e**x)+cos(tan(y))")


@cache
def readers() -> tuple[Reader, ...]:
    """Every reader with its good files."""
    round_ball, textured = ball(subdivisions=1), obj(faces=MIXED).replace("f 1 3", "vt 0 0\nf 1/1 3//1", 1)
    grouped = obj().replace("f ", "g lid end\nusemtl a\nf ")
    two_solids = text_stl().replace("endfacet\n", "endfacet\nendsolid\nsolid lid\n", 1)
    volumes = [bent(3, 2), bent(4, 3), benchmark_volume(2, 1, amplitude=0.4)]
    fields = [field_on(v, net) for v in volumes[:2] for net in (v.control_points[..., 0], v.control_points)]
    plain = BoundaryMap(cube().vertices, cube().vertices, cube().faces)
    box = replace(plain, part_faces=plain.faces, groups={"lid": np.array([0, 5]), "end": np.array([5])})
    numbers, points = list(range(8)), np.indices((2, 2, 2)).reshape(3, 8).T.tolist()
    return (
        surface_reader("obj", ".obj", obj(), textured, obj(*round_ball), grouped),
        surface_reader("stl, text", ".stl", text_stl(), text_stl(*TETRAHEDRON), two_solids),
        surface_reader("stl, binary", ".stl", binary_stl(*TETRAHEDRON), binary_stl(header=b"solid"), binary_stl()),
        surface_reader("ply, text", ".ply", ply(), ply(faces=MIXED), flagged_ply()),
        surface_reader("ply, binary", ".ply", ply(binary=True), ply(faces=MIXED, binary=True)),
        surface_reader("ply, any", ".ply", *(plies.content(form) for plies in any_plies() for form in FORMS)),
        surface_reader("off", ".off", off(), off(faces=MIXED).replace("OFF\n", "OFF\n# a cube\n\n")),
        surface_reader("off, words", ".off", off().replace("\n", " "), off().replace("\n4 ", " 1 0 0 1\n4\n")),
        meshio_reader(".mesh", ".mesh", {}),
        surface_reader(".mesh, sections", ".mesh", medit(), medit(more="RequiredTriangles 2\n1 2\n")),
        meshio_reader("msh, text", ".msh", *({"file_format": f, "binary": False} for f in ("gmsh", "gmsh22"))),
        meshio_reader("msh, binary", ".msh", *({"file_format": f, "binary": True} for f in ("gmsh", "gmsh22"))),
        surface_reader("msh, any", ".msh", *any_mshs()),
        surface_reader("vtu of VTK", ".vtu", *vtk_files()),
        meshio_reader("vtu", ".vtu", {"binary": False}, {"compression": None}, {"compression": "zlib"}),
        surface_reader("vtp", ".vtp", *vtk_polygons(".vtp")),
        surface_reader("vtk", ".vtk", *legacy_vtks()),
        *scene_readers(),
        npz_reader("volume.npz", check, *volumes),
        npz_reader("volume.npz of patches", read_volume, glued(3, 2)),
        npz_reader("volume.npz, rational", read_volume, exact_ring()),
        npz_reader("solution.npz", given(SplineField.load), *fields),
        npz_reader("boundary.npz", given(BoundaryMap.load), box),
        checkpoint_reader(),
        Reader(
            "corners",
            ".json",
            given(read_corners_of_cube),
            tuple([json.dumps(rows).encode()] for rows in (numbers, points)),
        ),
        *foreign_readers(),
        Reader("formula", ".txt", given(read_formula), tuple([text.encode()] for text in FORMULAS)),
    )


@cache
def whole_files() -> tuple[bytes, ...]:
    return tuple(reader.pack(seed) for reader in readers() for seed in reader.seeds)


# Judging.


@contextmanager
def overheard() -> Iterator[io.BufferedRandom]:
    """A file that gets what Python and libraries below it say on stderr; stdout is dropped."""
    with tempfile.TemporaryFile() as told, io.TextIOWrapper(told, write_through=True) as text:
        before = os.dup(2)
        os.dup2(told.fileno(), 2)
        try:
            with redirect_stderr(text), redirect_stdout(io.StringIO()):
                yield told
        finally:
            os.dup2(before, 2)
            os.close(before)


def judge(reader: Reader, path: Path, content: bytes) -> tuple[str, str]:
    """Outcome of one file, and what was said or raised."""
    path.write_bytes(content)
    started = time.process_time()
    with overheard() as told:
        try:
            reader.read(path)
            outcome, line = "accepted", ""
        except REFUSALS as error:
            names_it = path.name in str(error) or "corners" in str(error)
            outcome, line = "refused" if names_it else "crashed", one_line(error)
        except BaseException:  # SystemExit, too
            outcome, line = "crashed", traceback.format_exc()
        told.seek(0)
        said = told.read().decode(errors="replace")
    if time.process_time() - started > SECONDS:
        return "slow", line
    return ("crashed" if said else outcome), said + line


# The long run.


@dataclass
class Tally:
    """What became of a reader's files; peak: bytes the memory grew by."""

    outcomes: Counter[str]
    peak: int = 0


def check_seeds(reader: Reader) -> None:
    """Every seed is accepted; what is loaded and compiled once is then not counted against a file."""
    with tempfile.TemporaryDirectory() as folder:
        for seed in reader.seeds:
            outcome, said = judge(reader, Path(folder, f"file{reader.suffix}"), reader.pack(seed))
            assert outcome == "accepted", (reader.name, said)


def survey(reader: Reader, seed: int, count: int, failed: Path) -> Tally:
    """Read `count` files in a process, and in another one where that dies, hangs or takes too much memory."""
    tally, at = Tally(Counter()), 0
    context = multiprocessing.get_context("fork")
    while at < count:
        receiving, sending = context.Pipe(duplex=False)
        worker = context.Process(target=work, args=(reader, seed, range(at, count), count, sending))
        worker.start()
        sending.close()
        for number in range(at, count):
            outcome, said, grown = hear(receiving)
            at = number + 1
            tally.outcomes[outcome] += 1
            tally.peak = max(tally.peak, grown)
            if outcome in ("crashed", "slow"):
                keep(reader, number, *file_of(reader, seed, number, count), said, failed)
            if grown < 0 or grown > MEMORY:
                break
        worker.kill()
        worker.join()
    return tally


def work(reader, seed, numbers, count, pipe):
    """Read the files of these numbers in this process and send outcome, what was said, bytes grown by."""
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESSES, ADDRESSES))
    warnings.resetwarnings()
    for hidden in (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning):
        warnings.simplefilter("ignore", hidden)  # Python's own choice
    with tempfile.TemporaryDirectory() as folder:
        before = peak_memory()
        for number in numbers:
            suffix, content = file_of(reader, seed, number, count)
            outcome, said = judge(reader, Path(folder, f"file{suffix}"), content)
            grown = peak_memory() - before
            pipe.send(("slow" if grown > MEMORY else outcome, said, grown))


def hear(pipe):
    """What a worker sends; a size of -1 where it is gone or hangs."""
    try:
        if pipe.poll(6 * SECONDS):  # of the clock: others use the machine, too
            return pipe.recv()
    except EOFError:
        return "crashed", "the process died", -1
    return "slow", "the process hangs", -1


def peak_memory() -> int:
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def keep(reader, number, suffix, content, said, folder):
    folder.mkdir(parents=True, exist_ok=True)
    stem = re.sub(r"\W+", "-", reader.name)
    (folder / f"{stem}-{number}{suffix}").write_bytes(content)
    (folder / f"{stem}-{number}.said").write_text(said, encoding="utf-8")


def main() -> int:
    """Fuzz every reader, print the table, and return 1 where something failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--files", type=int, default=100_000, help="number of files, shared by the readers")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--reader", action="append", choices=[r.name for r in readers()], help="this one only")
    parser.add_argument("--failed", type=Path, default=Path("out/fuzz"), help="folder for the files that failed")
    options = parser.parse_args()
    chosen = [r for r in readers() if not options.reader or r.name in options.reader]
    tempfile.tempdir = SCRATCH if os.access(SCRATCH, os.W_OK) else None
    whole_files()  # before the processes part
    total = Counter[str]()
    print(f"{'reader':14s}", *(f"{outcome:>9s}" for outcome in OUTCOMES), f"{'peak MB':>8s} {'seconds':>8s}")
    for k, reader in enumerate(chosen):
        started = time.perf_counter()
        check_seeds(reader)
        count = (k + 1) * options.files // len(chosen) - k * options.files // len(chosen)
        tally = survey(reader, options.seed, round(reader.share * count), options.failed)
        seconds = time.perf_counter() - started
        counts = (f"{tally.outcomes[outcome]:9d}" for outcome in OUTCOMES)
        print(f"{reader.name:14s}", *counts, f"{tally.peak / 1e6:8.0f} {seconds:8.0f}", flush=True)
        total += tally.outcomes
    print(f"{'all':14s}", *(f"{total[outcome]:9d}" for outcome in OUTCOMES))
    return 1 if total["crashed"] + total["slow"] else 0


if __name__ == "__main__":
    sys.exit(main())
