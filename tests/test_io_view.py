"""Samples on linear cells, read back by pyvista, against the solution and its quantities."""

import json

import numpy as np
import pytest

import iga_nn
from iga_nn.cli.commands import main
from iga_nn.io import view
from parameterize.spline.bspline import divided_spans
from parameterize.spline.volume import BSplineVolume
from solve import benchmark_volume

pyvista = pytest.importorskip("pyvista")
ZERO = ("0", "0", "0")
PULLED = {**dict.fromkeys(("v0", "v1", "w0", "w1"), ZERO), "u1": ("1", "0", "0.5")}
TENSOR = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))


@pytest.fixture(scope="module")
def bent():
    problem = iga_nn.Elasticity(displacement=ZERO, traction=PULLED, young=210.0)
    return iga_nn.solve(benchmark_volume(2), problem, refine=1)


@pytest.fixture(scope="module")
def heat():
    return iga_nn.solve(benchmark_volume(2), iga_nn.Poisson(exact="exp(x)*y", kappa="1+x*x"), refine=1)


def nodes(solution, samples):
    """Parameters (m, 3) of the nodes, u fastest, on the solution's spans."""
    rows = [divided_spans(knots, samples) for knots in solution.knots]
    return np.stack([row.ravel(order="F") for row in np.meshgrid(*rows, indexing="ij")], axis=1)


def test_stress_and_displacement_stand_at_the_nodes_of_the_elements(bent):
    grid, where = bent.to_pyvista(2), nodes(bent, 2)
    np.testing.assert_allclose(grid.points, bent.geometry(where), atol=1e-12)
    np.testing.assert_allclose(grid["u"], bent(where), atol=1e-12)
    stress = bent.quantity("stress", where)
    np.testing.assert_allclose(grid["stress"], np.stack([stress[:, i, j] for i, j in TENSOR], axis=1), atol=1e-10)
    np.testing.assert_allclose(grid["von_mises"], bent.quantity("von_mises", where), atol=1e-10)
    names = [grid.GetPointData().GetArray("stress").GetComponentName(i) for i in range(6)]
    assert names == ["XX", "YY", "ZZ", "XY", "YZ", "XZ"]
    np.testing.assert_allclose(grid.warp_by_vector("u", factor=2.0).points, grid.points + 2.0 * grid["u"], atol=1e-12)


def test_gradient_and_flux_of_a_scalar_are_vectors(heat):
    grid, where = heat.to_pyvista(1), nodes(heat, 1)
    for name in ("gradient", "flux"):
        np.testing.assert_allclose(grid[name], heat.quantity(name, where)[:, 0], atol=1e-12)
    assert grid["u"].shape == grid["error"].shape == (len(where),)


def test_quantities_are_chosen_by_name_or_function(bent):
    asked = {"energy": lambda u, grad, x: (grad**2).sum(axis=(0, 1)), "slopes": "gradient", "three": "principal"}
    grid = bent.to_pyvista(1, quantities=asked)
    assert set(grid.point_data) == {"arap", "det J", "u", *asked}
    assert (grid["slopes"].shape[1], grid["three"].shape[1]) == (9, 3)  # no symmetric tensor
    np.testing.assert_allclose(grid["slopes"].reshape(-1, 3, 3), bent.quantity("gradient", nodes(bent, 1)), atol=1e-12)
    np.testing.assert_allclose(grid["energy"], (grid["slopes"] ** 2).sum(axis=1), rtol=1e-12)
    assert set(bent.to_pyvista(1, quantities=()).point_data) == {"arap", "det J", "u"}
    with pytest.raises(ValueError, match="Elasticity gives no 'heat'; it gives u, gradient"):
        bent.to_pyvista(1, quantities=["heat"])
    with pytest.raises(ValueError, match="quantities need linear cells: give samples"):
        bent.to_pyvista(quantities=["stress"])
    with pytest.raises(ValueError, match="quantities need a solution whose law is known"):
        view.grid(bent.geometry, None, None, 1, ["stress"])


def test_a_solve_leaves_its_cells_and_export_knows_the_law(in_folder, capsys):
    benchmark_volume(2).save("map.npz")
    given = ["--traction", "u1=1;0;0.5", "v0=0", "v1=0", "w0=0", "w1=0", "--young", "210", "--poisson-ratio", "0.2"]
    assert main(["solve", "elasticity", "map.npz", *given, "--refine", "1", "--out", "out", "--quiet"]) == 0
    problem = iga_nn.Elasticity(displacement=ZERO, traction=PULLED, young=210.0, poisson_ratio=0.2)
    solution = iga_nn.solve(benchmark_volume(2), problem, refine=1)
    kept = pyvista.read("out/solution.vtu")
    where = nodes(solution, view.SAMPLES)
    assert set(kept.point_data) == {"u", "stress", "von_mises"}
    np.testing.assert_allclose(kept["von_mises"], solution.quantity("von_mises", where), rtol=1e-5, atol=1e-6)
    export = ["export", "map.npz", "--solution", "out/solution.npz"]
    assert main([*export, "--to", "view", "--samples", "1", "--quantity", "principal", "--quantity", "strain"]) == 0
    seen = pyvista.read("map_view.vtu")
    assert set(seen.point_data) == {"arap", "det J", "u", "principal", "strain"}
    np.testing.assert_allclose(seen["principal"], solution.quantity("principal", nodes(solution, 1)), atol=1e-8)
    capsys.readouterr()
    for more, says in (
        (["--to", "view", "--quantity", "flow"], "Elasticity gives no 'flow'; it gives u, gradient"),
        (["--to", "view", "--samples", "0"], "samples 0: must be 1 or larger"),
        (["--to", "vtk", "--samples", "1"], "format 'vtk': --samples is for --to view, calculix"),
    ):
        assert main([*export, *more, "--force"]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert says in line


def test_where_det_j_is_zero_there_are_values_only(caplog):
    wedge = BSplineVolume.from_function(lambda u, v, w: (u, v, u * w), 4)
    solution = iga_nn.solve(benchmark_volume(2), iga_nn.Poisson(exact="x*y"))
    grid = view.grid(wedge, solution.field, solution.problem, 1)
    assert set(grid.point_data) == {"arap", "det J", "u", "error"}
    assert "gradient and flux left out: Singular matrix" in caplog.text
    with pytest.raises(ValueError, match="Singular matrix"):
        view.grid(wedge, solution.field, solution.problem, 1, ["flux"])


@pytest.mark.parametrize("report", [None, {"schema": 1, "elasticity": {"young": "hard"}}])
def test_a_solution_without_a_law_has_values_only(bent, report, in_folder, capsys):
    bent.geometry.save("map.npz")
    bent.save("solution.npz")
    if report:
        (in_folder / "report.json").write_text(json.dumps(report))
    assert main(["export", "map.npz", "--to", "view", "--solution", "solution.npz"]) == 0
    assert set(pyvista.read("map_view.vtu").point_data) == {"arap", "det J", "u"}
    wanted = ["--quantity", "stress", "--force"]
    assert main(["export", "map.npz", "--to", "view", "--solution", "solution.npz", *wanted]) == 2
    assert "quantities need a solution whose law is known, by the report.json beside it" in capsys.readouterr().err


@pytest.mark.parametrize(("most", "points", "spans"), [(1000, 1000, 1), (999, 343, 1), (100, 64, 1), (63, 27, 2)])
def test_a_large_solution_has_fewer_cells(most, points, spans, tmp_path, monkeypatch):
    cube = BSplineVolume.from_function(lambda u, v, w: (u, v, w), 6)  # three spans a direction
    solution = iga_nn.solve(cube, iga_nn.Poisson(exact="x*y"))
    monkeypatch.setattr(view, "MOST_KEPT", most)
    assert view.write_solution(tmp_path / "solution.vtu", solution) == spans
    grid = pyvista.read(tmp_path / "solution.vtu")
    assert grid.n_points == points and grid.volume == pytest.approx(1.0, rel=1e-6)
    x, y, _ = grid.points.T
    np.testing.assert_allclose(grid["u"], x * y, atol=1e-6)


def test_the_largest_file_stays_below_20_megabytes(tmp_path):
    """Numbers without a pattern, which cannot be compressed, at as many points as are kept: a third of them here."""
    volume = BSplineVolume.from_function(lambda u, v, w: (u, v, w), 16)
    field = np.random.default_rng(0).standard_normal((16, 16, 16, 3))
    solution = iga_nn.solve(volume, iga_nn.Elasticity(displacement=ZERO, traction=PULLED))
    object.__setattr__(solution.only, "coefficients", field)
    view.write_solution(tmp_path / "solution.vtu", solution)
    points = pyvista.read(tmp_path / "solution.vtu").n_points
    assert points > 60_000 and (tmp_path / "solution.vtu").stat().st_size / points * view.MOST_KEPT < 20e6


def test_distortion_is_that_of_a_cube_of_volume_1_or_of_the_boxes_of_several_patches():
    """A rod of 4 x 1 x 1 has the sides 4 s, s, s at volume 1, s = 4^(-1/3); in its own box it is not distorted."""
    rod = BSplineVolume.from_function(lambda u, v, w: (4.0 * u, v, w), 4)
    scale = 4.0 ** (-1.0 / 3.0)
    expected = (4.0 * scale - 1.0) ** 2 + 2.0 * (scale - 1.0) ** 2
    assert view.grid(rod, samples=1).point_data["arap"] == pytest.approx(expected)
    both = iga_nn.Body.from_patches([rod, BSplineVolume.from_function(lambda u, v, w: (4.0 + u, v, w), 4)])
    assert np.abs(view.grid(both, samples=1).point_data["arap"]).max() < 1e-20
