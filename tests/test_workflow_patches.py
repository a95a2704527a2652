"""Bodies of several patches on the command line: check, solve, study, modes, export, and what they write."""

import json

import numpy as np
import pytest
from volumes import mapped

import iga_nn
from iga_nn.cli.commands import main
from iga_nn.figures import render as rendering
from iga_nn.options import texts
from solve.field import BodyField


def ell():
    """An L of three cubes."""
    places = [(0, 0), (1, 0), (0, 1)]
    cubes = [mapped(lambda u, v, w, a=a, b=b: (a + u, b + v, w), (4, 4, 4), (2, 2, 2)) for a, b in places]
    return iga_nn.Body.from_patches(cubes)


def rod():
    """Two cubes along x."""
    cubes = [mapped(lambda u, v, w, a=a: (a + u, v, w), (3, 3, 3), (2, 2, 2)) for a in (0, 1)]
    return iga_nn.Body.from_patches(cubes)


def report_of(folder):
    return json.loads((folder / "report.json").read_text())


def test_check_says_what_is_proved_of_a_body_and_its_patches(in_folder, capsys):
    ell().save("ell.npz")
    assert main(["check", "ell.npz", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert (facts["bijective"], facts["boundary_injective"], facts["euler_number"]) == ("certified", True, 2)
    assert facts["interfaces"] == ["p0_u1 = p1_u0", "p0_v1 = p2_v0"] and facts["outer_faces"] == 14
    assert (
        facts["control_points"] == 3 * 64 - 2 * 16 and [len(p["control_points"]) for p in facts["patches"]] == [3] * 3
    )
    assert main(["check", "ell.npz"]) == 0
    assert "p2:              certified, 4 × 4 × 4 control points, degrees 2, 2, 2" in capsys.readouterr().out


def test_a_patch_that_is_folded_back_is_not_certified(in_folder, capsys):
    back = mapped(lambda u, v, w: (1 - u / 2, v, w), (3, 3, 3), (2, 2, 2))
    iga_nn.Body.from_patches([rod().patches[0], back]).save("back.npz")
    assert main(["solve", "poisson", "back.npz", "--refine", "0", "--out", "back"]) == 3
    said = capsys.readouterr().out
    assert "folded back      at p0_u1 = p1_u0" in said and "one sign of det J folded; one-to-one: no" in said
    page = (in_folder / "back" / "report.html").read_text()
    assert "Two patches lie on the same side of p0_u1 = p1_u0" in page


def test_a_body_with_a_part_inside_another_overlaps(in_folder, capsys):
    inside = mapped(lambda u, v, w: (0.3 + 0.1 * u, 0.3 + 0.1 * v, 0.3 + 0.1 * w), (3, 3, 3), (2, 2, 2))
    iga_nn.Body.from_patches([*rod().patches, inside]).save("both.npz")
    assert main(["solve", "poisson", "both.npz", "--refine", "0", "--out", "both"]) == 3
    said = capsys.readouterr().out
    assert "overlaps         parts of the body" in said and "det J > 0 certified; one-to-one: no" in said
    facts = report_of(in_folder / "both")["parameterization"]
    assert facts["overlap"] and facts["euler_number"] == 4
    assert "Parts of the body overlap." in (in_folder / "both" / "report.html").read_text()


@pytest.mark.pictures
def test_figures_and_page_of_a_body(in_folder):
    if not rendering.can_draw():
        pytest.skip(f"VTK cannot draw on this machine; remedy: {rendering.REMEDY}")
    ell().save("ell.npz")
    given = ["ell.npz", "--exact=x*y", "--neumann", "p1_u1", "--refine", "0", "--out", "out"]
    assert main(["solve", "poisson", *given]) == 0
    assert "not_drawn" not in report_of(in_folder / "out")
    for name in ("solution", "error", "named_faces"):
        assert (in_folder / "out" / f"{name}.png").stat().st_size > 5000
    page = (in_folder / "out" / "report.html").read_text()
    assert "2 interfaces, 14 outer faces" in page and "flux κ ∂u/∂n on p1_u1" in page


def test_a_solution_is_written_and_read_back(in_folder):
    import pyvista

    body, folder = ell(), in_folder / "out"
    body.save("ell.npz")
    assert main(["solve", "poisson", "ell.npz", "--exact=x*x+y*z", "--refine", "0", "1", "--out", "out"]) == 0
    report = report_of(folder)
    assert report["poisson"]["levels"][-1]["l2_relative"] < 1e-9
    assert "interactive view" not in report.get("not_drawn", {})
    found, points = BodyField.load(folder / "solution.npz"), np.array([[0.3, 0.4, 0.5], [1.7, 0.2, 0.9]])
    solution = iga_nn.solve(body, iga_nn.Poisson(exact="x*x+y*z"), refine=1)
    assert all(
        np.allclose(one.coefficients, other.coefficients, atol=1e-9)
        for one, other in zip(found.patches, solution.patches, strict=True)
    )
    grid = pyvista.read(folder / "solution.vtu")
    x, y, z = grid.points.T
    assert np.abs(grid.point_data["u"] - (x * x + y * z)).max() < 1e-5
    assert sorted(set(grid.cell_data["patch"])) == [0, 1, 2]
    centres = grid.cell_centers().points
    assert np.all((centres[:, 0] > 1) == (grid.cell_data["patch"] == 1))
    assert np.allclose(solution.probe(points), points[:, 0] ** 2 + points[:, 1] * points[:, 2], atol=1e-9)


def test_a_solution_that_is_no_bodys_is_refused(in_folder):
    np.savez("other.npz", coefficients=np.zeros(3))
    with pytest.raises(ValueError, match="has no array named degrees"):
        BodyField.load("other.npz")


def test_faces_of_patches_carry_data(in_folder, capsys):
    """u = 0 and 1 at the ends of a rod, kappa 1 and 2: u = 2/3 between the patches. u0 alone is that of patch 0."""
    rod().save("rod.npz")
    ends = ["--value", "u0=0", "--value", "p1_u1=1"]
    given = ["rod.npz", *ends, "--kappa", "p0: 1, p1: 2", "--refine", "0", "--out", "out"]
    assert main(["solve", "poisson", *given]) == 0
    field = BodyField.load("out/solution.npz")
    assert field.patches[1]([[0.0, 0.5, 0.5], [0.5, 0.2, 0.1]]) == pytest.approx([2 / 3, 5 / 6], abs=1e-8)
    assert "p0: 1, p1: 2" in (in_folder / "out" / "report.html").read_text()
    regions = report_of(in_folder / "out")["poisson"]["regions"]
    assert [region["region"] for region in regions] == ["u0", "p1_u1"]
    natural = ["--neumann", "p0_v0=0", "--neumann", "v1=0", "--source", "0", "--boundary", "x"]
    assert main(["solve", "poisson", "rod.npz", *natural, "--refine", "0", "--out", "natural"]) == 0
    assert main(["solve", "poisson", "rod.npz", "--neumann", "p0_u1=0", "--source", "0", "--out", "x"]) == 2
    assert "p0_u1 is no outer face of the body" in capsys.readouterr().err


def test_the_material_of_a_body_may_differ_by_patch(in_folder, capsys):
    """A rod with E = 1 and 4 under traction 1: it is longer by 1 up to the second patch, and by 1.25 in all."""
    rod().save("rod.npz")
    given = ["rod.npz", "--fix", "p0_u0=0;;", "--fix", "v0=;0;", "--fix", "w0=;;0", "--load", "p1_u1=1;0;0"]
    stiff = ["--young", "p0: 1, p1: 4", "--poisson-ratio", "0", "--refine", "0", "--out", "out"]
    assert main(["solve", "elasticity", *given, *stiff]) == 0
    field = BodyField.load("out/solution.npz")
    ends = field.patches[1]([[0.0, 0.5, 0.5], [1.0, 0.5, 0.5]])[:, 0]
    assert ends == pytest.approx([1.0, 1.25], abs=1e-6)
    stress = report_of(in_folder / "out")["elasticity"]["levels"][0]["extremes"]["von_mises"]
    assert (stress["least"], stress["largest"]) == pytest.approx((1.0, 1.0), abs=1e-5)
    assert "E = p0: 1, p1: 4" in (in_folder / "out" / "report.html").read_text()
    assert main(["modes", "rod.npz", "--young", "p0: 1", "--out", "x"]) == 2
    assert "young has no entry for patch 1" in capsys.readouterr().err


def test_the_material_of_a_body_may_differ_by_solid(in_folder, capsys):
    """The same rod, whose second patch is a solid with a name of its own."""
    iga_nn.Body(rod().patches, rod().interfaces, ("steel", "rubber pad")).save("rod.npz")
    held = ["rod.npz", "--fix", "p0_u0=0;;", "--fix", "v0=;0;", "--fix", "w0=;;0", "--load", "p1_u1=1;0;0"]
    given = ["solve", "elasticity", *held, "--poisson-ratio", "0", "--refine", "0", "--out", "out"]
    assert main([*given, "--young", "steel: 1, rubber pad: 4"]) == 0
    field = BodyField.load("out/solution.npz")
    assert field.patches[1]([[1.0, 0.5, 0.5]])[0, 0] == pytest.approx(1.25, abs=1e-6)
    page, report = (in_folder / "out" / "report.html").read_text(), report_of(in_folder / "out")
    assert "E = steel: 1, rubber pad: 4" in page and "Volume of rubber pad" in page
    solids = report["parameterization"]["solids"]
    assert [(solid["name"], solid["patches"]) for solid in solids] == [("steel", 1), ("rubber pad", 1)]
    assert [solid["volume"] for solid in solids] == pytest.approx([1.0, 1.0])
    assert main(["check", "rod.npz"]) == 0
    assert "rubber pad, volume 1, 1 patch" in capsys.readouterr().out
    assert main([*given, "--force", "--young", "steel: 1, pad: 4"]) == 2
    assert "young: there is no solid 'pad'; the body has steel, rubber pad" in capsys.readouterr().err
    assert main(["solve", "poisson", "rod.npz", "--source", "1", "--boundary", "0", "--kappa", "steel: 1"]) == 2
    assert "kappa has no entry for solid 'rubber pad'" in capsys.readouterr().err
    assert main(["modes", "rod.npz", "--density", "steel: 1, rubber pad: 4", "--number", "1", "--out", "modes"]) == 0
    assert main(["modes", "rod.npz", "--density", "steel: 1", "--out", "x"]) == 2
    assert "density has no entry for solid 'rubber pad'" in capsys.readouterr().err


def test_texts_by_patch():
    assert texts.by_patch("--kappa", "1,0,0,1,0,1", str) == "1,0,0,1,0,1"
    assert texts.by_patch("--kappa", " p0: 1,2 , p12:x+y", str) == {0: "1,2", 12: "x+y"}
    several = "steel: 1,0,0,1,0,1, a rubber pad:x+y, 'bolt, M6: long': 2"
    assert texts.by_patch("--kappa", several, str) == {
        "steel": "1,0,0,1,0,1",
        "a rubber pad": "x+y",
        "bolt, M6: long": "2",
    }
    for text in ("p0: 1, p0: 2", "1, p1: 2", "steel: 1, steel: 2", "steel: 1, p1: 2"):
        with pytest.raises(iga_nn.InputError, match="write one entry a solid"):
            texts.by_patch("--kappa", text, str)
    with pytest.raises(iga_nn.InputError, match="give a number, or one a solid"):
        iga_nn.ElasticityOptions(young="soft", body_force="0;0;1").problem()


def test_a_study_and_modes_of_a_body(in_folder):
    ell().save("ell.npz")
    assert main(["study", "ell.npz", "--refine", "0..2", "--out", "study"]) == 0
    levels = report_of(in_folder / "study")["study"]["levels"]
    assert levels[-1]["rate_l2"] > 2.8
    assert main(["modes", "ell.npz", "--fix", "p2_v1", "--number", "2", "--out", "modes"]) == 0
    arrays = np.load("modes/modes.npz")
    assert arrays["p1_coefficients"].shape == (2, 4, 4, 4, 3) and len(arrays["frequencies"]) == 2
    assert report_of(in_folder / "modes")["modes"]["frequencies"] == pytest.approx(arrays["frequencies"].tolist())
    shared = arrays["p0_coefficients"][:, -1], arrays["p1_coefficients"][:, 0]
    assert np.allclose(*shared, atol=1e-12) and np.abs(shared[0]).max() > 0.01


def test_a_solution_on_a_body_is_exported(in_folder, capsys):
    import pyvista

    ell().save("ell.npz")
    assert main(["solve", "poisson", "ell.npz", "--exact=x+y*y", "--refine", "0", "--out", "out"]) == 0
    for kind in ("gismo", "vtk", "view"):
        main(["export", "ell.npz", "--to", kind, "--solution", "out/solution.npz"])
    assert (in_folder / "ell_u.xml").read_text().count("<Geometry") == 3
    for file in ("ell_bezier.vtu", "ell_view.vtu"):
        assert np.bincount(pyvista.read(file).cell_data["patch"].astype(int)).tolist() in ([8] * 3, [216] * 3)
    view = pyvista.read("ell_view.vtu")
    x, y, _ = view.points.T
    assert view.point_data["u"] == pytest.approx(x + y * y, abs=1e-9) and "flux" in view.point_data
    assert view.point_data["error"].max() < 1e-9
    exact = pyvista.read("ell_bezier.vtu")
    corners = np.unique(exact.cells.reshape(exact.n_cells, -1)[:, 1:9])
    x, y, _ = exact.points[corners].T
    assert exact.point_data["u"][corners] == pytest.approx(x + y * y, abs=1e-9)
    assert main(["export", "ell.npz", "--to", "mfem", "--solution", "out/solution.npz"]) == 0
    assert (in_folder / "ell.gf").read_text().startswith("FiniteElementSpace")
    capsys.readouterr()
    rod().save("rod.npz")
    assert main(["export", "rod.npz", "--to", "vtk", "--solution", "out/solution.npz"]) == 2
    assert "belongs to another volume" in capsys.readouterr().err
