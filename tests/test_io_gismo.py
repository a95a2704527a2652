"""G+Smo XML of several patches: written ones are read by G+Smo itself, those of G+Smo here."""

import gzip

import numpy as np
import pytest
from bodies import exact_ring, ring, row_of
from foreign_models import patch_files
from glued import POINTS, demand_same

import iga_nn
from iga_nn.io.beginnings import is_volume
from iga_nn.io.gismo import read_gismo, write_gismo
from parameterize.spline.interface import axis_side, varying
from parameterize.spline.volume import FACE_NAMES

TURNS = [((0, 1, 2), (False, False, False)), ((1, 2, 0), (True, False, True)), ((2, 1, 0), (False, True, False))]
BODIES = {
    "corner": row_of([(0, 0, 0), (1, 0, 0), (1, 1, 0)], TURNS),
    "ring": ring(1),
    "three": ring(3),
    "exact": exact_ring(),
}


@pytest.fixture(params=BODIES)
def body(request, in_folder):
    BODIES[request.param].save("body.npz")
    return BODIES[request.param]


def cube(number, shift=0, kind="TensorBSpline3", knots="0 0 1 1", weights="", coefs=None):
    """A unit cube at x = `shift` as G+Smo writes it."""
    rows = coefs or "".join(f"{x + shift} {y} {z}\n" for z in (0, 1) for y in (0, 1) for x in (0, 1))
    bases = "".join(
        f'<Basis type="BSplineBasis" index="{axis}"><KnotVector degree="1">{knots} </KnotVector></Basis>\n'
        for axis in range(3)
    )
    basis = f'<Basis type="TensorBSplineBasis3">\n{bases}</Basis>\n'
    if weights:
        basis = f'<Basis type="TensorNurbsBasis3">{basis}<weights>{weights}</weights></Basis>'
    return f'<Geometry type="{kind}" id="{number}">{basis}<coefs geoDim="3">{rows}</coefs></Geometry>\n'


def surface(number):
    return f'<Geometry type="TensorBSpline2" id="{number}"><coefs geoDim="3">0 0 0</coefs></Geometry>\n'


def opened(text, in_folder):
    (in_folder / "file.xml").write_text(text)
    return iga_nn.load_volume("file.xml")


def test_what_was_written_is_read_again(body):
    demand_same(iga_nn.load_volume(iga_nn.export("body.npz", "gismo")), body)


def test_gismo_reads_its_patches_and_interfaces(body):
    pygismo = pytest.importorskip("pygismo")
    patches = pygismo.core.gsMultiPatch()
    pygismo.io.gsFileData(str(iga_nn.export("body.npz", "gismo"))).getId(0, patches)
    for number, patch in enumerate(body):
        assert np.abs(patches.patch(number).eval(POINTS.T).T - patch(POINTS)).max() < 1e-12
    assert patches.nPatches() == len(body)
    assert len(patches.interfaces()) == len(body.interfaces)
    assert len(patches.boundaries()) == sum(map(len, body.outer))


def test_the_interfaces_of_a_file_say_how_faces_lie_on_each_other(body, in_folder):
    """G+Smo's rule: along an interface direction d of the first patch is direction map[d] of the second."""
    text = iga_nn.export("body.npz", "gismo").read_text()
    rows = text.partition("<interfaces>")[2].partition("</interfaces>")[0].splitlines()
    assert len(rows) == len(body.interfaces)
    for row in rows:
        p, side_p, q, side_q, *way = map(int, row.split())
        along, same = way[:3], way[3:]
        (axis, side), (other, other_side) = axis_side(FACE_NAMES[side_p - 1]), axis_side(FACE_NAMES[side_q - 1])
        first, second = POINTS.copy(), np.empty_like(POINTS)
        first[:, axis], second[:, other] = side, other_side
        for a in varying(FACE_NAMES[side_p - 1]):
            second[:, along[a]] = first[:, a] if same[a] else 1.0 - first[:, a]
        assert along[axis] == other and same[axis] == (side != other_side)
        assert np.abs(body.patches[p - 100](first) - body.patches[q - 100](second)).max() < 1e-12


def test_a_list_of_geometries_is_a_body(in_folder, caplog):
    """Comments before the declaration, knots from -1 to 3, fractions, a surface beside the volumes."""
    thirds = cube(7, 1, knots="-1 -1 3 3").replace("1 0 0", "3/3 0 0")
    body = opened(f'<!-- two -->\n<?xml version="1.0"?>\n<xml>{cube(5)}{surface(6)}{thirds}</xml>', in_folder)
    assert [str(interface) for interface in body.interfaces] == ["p0_u1 = p1_u0"]
    assert np.abs(body.patches[1](POINTS) - POINTS - [1.0, 0.0, 0.0]).max() < 1e-14
    assert "left out: TensorBSpline2" in caplog.text


def test_a_multipatch_chooses_among_the_geometries(in_folder):
    """It names them by their ids, in its own order; interfaces name ids, too."""
    chosen = '<MultiPatch parDim="3" id="9"><patches type="id_index">7 5</patches><interfaces>7 1 5 2 0 1 2 1 1 1\n'
    chosen += "</interfaces><boundary>7 2</boundary></MultiPatch>"
    body = opened(f"<xml>{cube(5)}{cube(6, 5)}{cube(7, 1)}{chosen}</xml>", in_folder)
    assert [str(interface) for interface in body.interfaces] == ["p0_u0 = p1_u1"]


def test_geometries_without_ids_or_with_one_id_are_all_taken(in_folder):
    """As in G+Smo's own cube.xml and cylinder.xml."""
    for content in (cube(1) + cube(1, 1), (cube(1) + cube(1, 1)).replace(' id="1"', "")):
        assert len(opened(f"<xml>{content}</xml>", in_folder).interfaces) == 1


@pytest.mark.parametrize(
    ("rows", "says"),
    [
        ("0 2 1 2 0 1 2 1 1 1", "interface p0_u1 = p1_u1: the file says that they are one, .* are 1 apart"),
        ("0 2 4 1 0 1 2 1 1 1", "an interface of its MultiPatch names no patch and side: 4 1"),
        ("0 2 1 x", "an interface of its MultiPatch must be whole numbers"),
    ],
)
def test_interfaces_that_are_none_are_refused(rows, says, in_folder):
    chosen = (
        f'<MultiPatch parDim="3"><patches type="id_range">0 1</patches><interfaces>{rows}</interfaces></MultiPatch>'
    )
    with pytest.raises(iga_nn.InputError, match=rf"file\.xml: {says}"):
        opened(f"<xml>{cube(0)}{cube(1, 1)}{chosen}</xml>", in_folder)


def test_faces_that_a_file_calls_one_though_they_are_apart(in_folder):
    """The message has the distance, and a tolerance that makes them one: the first patch stays as it is."""
    chosen = (
        '<MultiPatch parDim="3"><patches type="id_range">0 1</patches><interfaces>0 2 1 1</interfaces></MultiPatch>'
    )
    text = f"<xml>{cube(0)}{cube(1, 1.001)}{chosen}</xml>"
    with pytest.raises(iga_nn.InputError, match=r"are 0\.001 apart, 5\.0e-04 of .*tolerance=5\.5e-04\) makes them one"):
        opened(text, in_folder)
    body = iga_nn.load_volume("file.xml", tolerance=5.5e-4)
    assert [str(interface) for interface in body.interfaces] == ["p0_u1 = p1_u0"]
    assert np.array_equal(body.patches[1].control_points[0], body.patches[0].control_points[-1])
    assert body.patches[1].control_points[:, 0, 0, 0] == pytest.approx([1.0, 2.001], rel=1e-12)


@pytest.mark.parametrize("tolerance", [-1.0, 1.0, float("nan"), "wide"])
def test_tolerances_that_are_none_are_refused(tolerance, in_folder):
    (in_folder / "file.xml").write_text(f"<xml>{cube(0)}</xml>")
    with pytest.raises(iga_nn.InputError, match=r"^tolerance"):
        iga_nn.load_volume("file.xml", tolerance=tolerance)


def test_an_interface_that_is_not_listed_is_told(in_folder, caplog):
    chosen = (
        '<MultiPatch parDim="3"><patches type="id_range">0 2</patches><interfaces>0 2 1 1</interfaces></MultiPatch>'
    )
    body = opened(f"<xml>{cube(0)}{cube(1, 1)}{cube(2, 2)}{chosen}</xml>", in_folder)
    assert len(body.interfaces) == 2 and "p1_u1 = p2_u0: glued" in caplog.text


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("", "holds no Geometry"),
        (surface(0), "holds a TensorBSpline2; a volume is"),
        (cube(0) + 2 * '<MultiPatch parDim="3"><patches type="id_range">0 0</patches></MultiPatch>', "2 MultiPatches"),
        (cube(0) + '<MultiPatch parDim="3"/>', "its MultiPatch has no patches"),
        (cube(0, coefs="0 0 0 1"), "three numbers each"),
    ],
)
def test_files_without_a_body_are_refused(content, says, in_folder):
    with pytest.raises(iga_nn.InputError, match=rf"file\.xml: .*({says})"):
        opened(f"<xml>{content}</xml>", in_folder)


@pytest.mark.parametrize(("name", "patches", "interfaces"), [("fichera.xml", 7, 9), ("GshapedVolume.xml", 1, 0)])
def test_models_of_gismo_open(name, patches, interfaces, tmp_path):
    for path in patch_files(name):
        read = iga_nn.Body.from_patches(read_gismo(path.read_text())[0])
        assert (len(read), len(read.interfaces)) == (patches, interfaces)
        write_gismo(tmp_path / "again.xml", read)
        assert isinstance(iga_nn.load_volume(path), iga_nn.BSplineVolume if patches == 1 else iga_nn.Body)
        demand_same(iga_nn.Body.from_patches(read_gismo((tmp_path / "again.xml").read_text())[0]), read)


@pytest.mark.parametrize("name", ["file.xml.gz", "file.xml"])
def test_packed_files_are_read(name, in_folder):
    """By their first bytes, as G+Smo does; also to solve on, so `is_volume` knows them."""
    (in_folder / name).write_bytes(gzip.compress(f"<xml>{cube(0)}</xml>".encode()))
    assert np.abs(iga_nn.load_volume(name)(POINTS) - POINTS).max() < 1e-15
    assert is_volume(name)
    (in_folder / "part.gltf.gz").write_bytes(gzip.compress(b"{}"))
    assert not is_volume("part.gltf.gz")


@pytest.mark.parametrize("count", [200, 5000])
def test_a_packed_file_that_is_cut_off_is_refused(count, in_folder):
    noise = np.random.default_rng(0).bytes(9999)
    (in_folder / "file.xml.gz").write_bytes(gzip.compress(f"<xml>{cube(0)}</xml>".encode() + noise)[:count])
    with pytest.raises(iga_nn.InputError, match=r"file\.xml\.gz: is not a whole \.gz file .*: save it again"):
        iga_nn.load_volume("file.xml.gz")


def test_comments_may_be_in_latin_1(in_folder):
    text = f'<?xml version="1.0" encoding="ISO-8859-1"?><!-- V\u00e1zquez --><xml>{cube(0)}</xml>'
    (in_folder / "file.xml").write_bytes(text.encode("latin-1"))
    assert np.abs(iga_nn.load_volume("file.xml")(POINTS) - POINTS).max() < 1e-15


def test_what_stands_beside_the_body_is_told(in_folder, caplog):
    """Boundary conditions, functions, and geometries that the MultiPatch does not name."""
    more = '<boundaryConditions id="4"/><Function id="5"/><MultiPatch parDim="3"><patches type="id_index">1</patches>'
    body = opened(f"<xml>{cube(0)}{cube(1, 1)}{more}</MultiPatch></xml>", in_folder)
    assert np.abs(body(POINTS) - POINTS - [1.0, 0.0, 0.0]).max() < 1e-15
    assert "left out: Function, TensorBSpline3, boundaryConditions" in caplog.text


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (
            cube(0).replace("</G", "<transform><rotation>0 0 1 1.57</rotation></transform></G"),
            "0 has a transform, which",
        ),
        ("<xmlfile>cube.xml</xmlfile>", "holds no Geometry, but names the file cube.xml: read that one"),
        (cube(0, kind="TensorNurbs3"), "Geometry 0 is a TensorNurbs3 without weights"),
        (cube(0, knots="0 0 1/0 1"), "the knots must be finite, got '1/0'"),
        (cube(0, knots="0 0 1/ 1"), "the knots must be numbers, got '1/'"),
    ],
)
def test_what_would_be_another_body_is_refused(content, says, in_folder):
    with pytest.raises(iga_nn.InputError, match=rf"file\.xml: .*{says}"):
        opened(f"<xml>{content}</xml>", in_folder)
