"""Left-handed volumes, whose det J is negative: the same body gives the same results."""

import dataclasses
from functools import cache

import numpy as np
import pytest
from vtkmodules.vtkCommonCore import reference

import iga_nn
from iga_nn.cli.commands import main
from iga_nn.figures import cutaway
from iga_nn.figures.fields import distortion_of, points_of
from parameterize.quality.distortion import arap, arap_grid, arap_on
from parameterize.spline.orientation import mirrored, orientation
from parameterize.spline.volume import FACE_NAMES, BSplineVolume
from solve import Elasticity, Form, Poisson, Problem, benchmark_volume, solve_problem
from solve.diagnostics import worst_place
from solve.discretization.space import trial_space
from solve.forms.frame import UnitFrame, face_geometry

WAVE = "exp(x+z)*sin(y)"
VOLUME = benchmark_volume(3)
PLACES = np.random.default_rng(0).random((60, 3))
ALL = dict.fromkeys(FACE_NAMES)


def reversed_along(volume, axis):
    """The same body with one direction reversed; its new parameters of old ones, and its new names of faces."""
    knots = list(volume.knots)
    knots[axis] = 1.0 - knots[axis][::-1]
    turned = BSplineVolume(volume.degrees, tuple(knots), np.flip(volume.control_points, axis))
    return turned, lambda p: np.where(np.arange(3) == axis, 1.0 - p, p), lambda name: _other_end(name, "uvw"[axis])


def _other_end(name, axis):
    return f"{axis}{1 - int(name[1])}" if name[0] == axis else name


def exchanged(volume, a, b):
    """The same body with two directions exchanged."""
    order = [0, 1, 2]
    order[a], order[b] = b, a
    turned = BSplineVolume(
        tuple(volume.degrees[i] for i in order),
        tuple(volume.knots[i] for i in order),
        volume.control_points.transpose(*order, 3),
    )
    return turned, lambda p: p[:, order], lambda name: "uvw"[order["uvw".index(name[0])]] + name[1]


TURNS = {
    **{f"{'uvw'[axis]} reversed": reversed_along(VOLUME, axis) for axis in range(3)},
    **{f"{'uvw'[a]}, {'uvw'[b]} exchanged": exchanged(VOLUME, a, b) for a, b in ((0, 1), (0, 2), (1, 2))},
}


class Own(Form):
    symmetric = False

    def flux(self, u, grad, x):
        return (2.0 + x[0]) * grad

    def react(self, u, grad, x):
        return grad[:, 1] + u


def own(**data):
    return Problem(Own(), exact=WAVE, **data)


def elastic(**data):
    return Elasticity(exact=("exp(x)*sin(y)", "cos(x*z)", "x*y*z"), young=7.0, **data)


def poisson(**data):
    return Poisson(exact=WAVE, kappa=("2+x*x", "0.3*y", "0.1", "1.5", "0.2*sin(z)", "1+z*z"), reaction="x*x", **data)


LAWS = {
    "neumann": (poisson, {"neumann": {"u0": None, "v1": None, "w0": None}}),
    "neumann all round": (lambda **data: Poisson(exact=WAVE, **data), {"neumann": ALL}),
    "robin": (poisson, {"robin": {"u1": ("2+x", None), "w0": ("3", None)}}),
    "mixed": (poisson, {"neumann": {"u0": None, "u1": "7"}, "robin": {"v0": ("1", None), "w1": ("2", "x*y")}}),
    "traction": (elastic, {"traction": {"u0": None, "v1": None, "w0": ("1", "0", "x")}}),
    "own form": (own, {"neumann": {"u1": None, "v0": None}, "robin": {"w0": ("2", None)}}),
}


def solved(volume, make, data):
    return solve_problem(volume, make(**data), tolerance=1e-13, estimate=True)


@cache
def right_handed(law):
    """The solution of a law on the volume that is not turned."""
    return solved(VOLUME, *LAWS[law])


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("turn", TURNS)
def test_the_solution_is_the_same_at_the_same_places(law, turn):
    (make, data), (turned, moved, named) = LAWS[law], TURNS[turn]
    assert orientation(turned) == -1
    other = {kind: {named(face): datum for face, datum in faces.items()} for kind, faces in data.items()}
    one, two = right_handed(law), solved(turned, make, other)
    assert np.abs(one(PLACES) - two(moved(PLACES))).max() < 1e-10 * np.abs(one(PLACES)).max()
    assert two.report.l2 == pytest.approx(one.report.l2, rel=1e-7)
    assert two.report.h == pytest.approx(one.report.h)
    assert two.report.error_estimate == pytest.approx(one.report.error_estimate, rel=1e-6)
    assert two.report.notices == one.report.notices


def test_a_flux_by_hand():
    """u = 1 + 3 x on a cube: the outward flux is 3 on the face x = 1, whatever the parameters are called there."""
    cube = benchmark_volume(2, amplitude=0.0)
    for volume, face in ((cube, "u1"), (reversed_along(cube, 0)[0], "u0"), (exchanged(cube, 0, 2)[0], "w1")):
        given = Poisson(source="0", boundary="1+3*x", neumann={face: "3"})
        derived = Poisson(exact="1+3*x", neumann={face: None})
        for problem in (given, derived):
            found = solve_problem(volume, problem, tolerance=1e-13)
            assert found(PLACES) == pytest.approx(1.0 + 3.0 * volume(PLACES)[:, 0], abs=1e-9)


def test_normals_point_outward_on_every_face():
    """From the middle of a convex body every face is seen from inside."""
    for volume in (VOLUME, *(turned for turned, _, _ in TURNS.values())):
        for k in range(6):
            x, area = face_geometry(volume, [np.linspace(0.1, 0.9, 4)] * 3, *divmod(k, 2))
            assert np.all((area * (np.asarray(x) - 0.5)).sum(axis=0) > 0.0)


def test_measures_of_the_map_are_those_of_its_mirror_image():
    image = mirrored(VOLUME)
    for one, two in zip(arap_grid(VOLUME)[1], arap_grid(image)[1], strict=True):
        np.testing.assert_allclose(two, one, rtol=1e-9)
    u = np.linspace(0.0, 1.0, 5)
    np.testing.assert_allclose(arap_on(image, u, u, u), arap(VOLUME.grid_jacobian(u, u, u)), rtol=1e-9, atol=1e-14)
    for one, two in zip(*(distortion_of(each).everywhere for each in (VOLUME, image)), strict=True):
        np.testing.assert_allclose(two, one, rtol=1e-9, atol=1e-7)
    assert UnitFrame.of(image).length == pytest.approx(UnitFrame.of(VOLUME).length)
    (place, _, worst), (image_place, _, image_worst) = (worst_place(v, trial_space(v)) for v in (VOLUME, image))
    assert 0.0 < worst == image_worst and np.array_equal(place, image_place)


def test_folds_are_counted_as_in_the_mirror_image():
    folded = benchmark_volume(4, amplitude=0.4)
    one, two = (
        solve_problem(volume, Poisson(source="1"), max_iterations=1).report.notices
        for volume in (folded, mirrored(folded))
    )
    assert any(line.startswith("det J < 0 at ") for line in one)
    assert any(line.startswith("the map is left-handed, and det J > 0 at ") for line in two)
    assert iga_nn.certify(mirrored(folded)).verdict == "folded"


def test_the_cut_looks_into_the_body():
    """The octant that is left out is the one nearest to the viewer."""
    cube, size = benchmark_volume(1, amplitude=0.0), np.array([3.0, 2.0, 1.0])
    volume = dataclasses.replace(cube, control_points=cube.control_points * size)
    turned, _, _ = reversed_along(volume, 1)
    corner, view = cutaway.best_cut(points_of(turned).planes[:6], orientation(turned))
    place = turned(np.array([corner], dtype=float))[0] / size
    assert np.all(np.sign(view.towards) == np.round(2.0 * place - 1.0))


@pytest.mark.parametrize("samples", [None, 2])
def test_cells_for_vtk_are_right_handed(samples):
    """Corner 0 of a hexahedron sees its neighbours 1, 3 and 4 in a right-handed order; places and values stay."""
    for axis in range(3):
        turned, _, _ = reversed_along(VOLUME, axis)
        solution = solve_problem(turned, Poisson(exact="1+x"))
        grid, plain = (s.to_pyvista(samples) for s in (solution, solve_problem(VOLUME, Poisson(exact="1+x"))))
        corners = np.array([grid.points[cell.point_ids] for cell in grid.cell])[:, [0, 1, 3, 4]]
        assert np.all(np.linalg.det(corners[:, 1:] - corners[:, :1]) > 0.0)
        assert grid.n_points == plain.n_points and grid.n_cells == plain.n_cells
        if samples is not None:
            assert grid.compute_cell_sizes()["Volume"].sum() == pytest.approx(
                plain.compute_cell_sizes()["Volume"].sum()
            )
            assert np.all(grid["det J"] < 0.0) and grid["u"] == pytest.approx(1.0 + grid.points[:, 0], abs=1e-6)


def test_bezier_cells_hold_the_map_with_w_reversed():
    """VTK's own shape functions give the points of the map: cell 0 is the first span of u, v and w."""
    turned, _, _ = reversed_along(VOLUME, 0)
    cell = turned.to_pyvista().GetCell(0)
    for r in np.random.default_rng(1).random((5, 3)):
        found, weights = [0.0] * 3, [0.0] * cell.GetNumberOfPoints()
        cell.EvaluateLocation(reference(0), r, found, weights)
        assert found == pytest.approx(turned([[r[0] / 3, r[1] / 3, (1.0 - r[2]) / 3]])[0], abs=1e-6)


def test_check_says_one_to_one_and_left_handed(in_folder, capsys):
    TURNS["u reversed"][0].save("left.npz")
    assert main(["check", "left.npz"]) == 0
    said = capsys.readouterr().out
    assert "det J < 0        certified" in said and "one-to-one       yes" in said
    assert "orientation:     left-handed" in said
