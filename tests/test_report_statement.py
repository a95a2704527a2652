"""What the page says of the problem: equation, material, data, regions."""

from __future__ import annotations

from iga_nn.report.statement import regions_of, statement_of


def test_poisson_with_coefficients_and_data_on_faces():
    section = {"kappa": "1+x", "reaction": "2", "source": "1", "neumann": ["u1=x*y"], "robin": ["w0=3:x", "v0=1"]}
    assert statement_of({"poisson": section}) == [
        ("equation", "−∇·(κ ∇u) + c u = f"),
        ("κ", "1+x"),
        ("c", "2"),
        ("f", "1"),
        ("u elsewhere on the boundary", "0"),
        ("flux κ ∂u/∂n on u1", "x*y"),
        ("exchange on w0", "κ ∂u/∂n + α u = g, α = 3, g = x"),
        ("exchange on v0", "κ ∂u/∂n + α u = g, α = 1, g = from the exact solution"),
    ]


def test_poisson_of_an_exact_solution():
    rows = dict(statement_of({"poisson": {"exact": "x*y"}}))
    assert rows["equation"] == "−∇·(κ ∇u) = f" and rows["κ"] == "1" and rows["exact solution"] == "x*y"
    assert rows["f"] == rows["u on the boundary"] == "from the exact solution"


def test_elasticity_has_its_material():
    section = {"young": 210.0, "poisson_ratio": 0.25, "traction": ["u1=0;0;-1", "v0=0"]}
    rows = dict(statement_of({"elasticity": section}))
    assert rows["material"] == "Young's modulus E = 210, Poisson's ratio ν = 0.25; λ = 84, μ = 84"
    assert rows["traction σ n on u1"] == "0;0;-1" and rows["force f per volume"] == "0"
    assert rows["displacement u elsewhere on the boundary"] == "0"


def test_a_study_has_its_exact_solution_and_a_map_no_problem():
    assert statement_of({"study": {"exact": "x"}}) == [("exact solution", "x")]
    assert statement_of({"parameterization": {}}) == []


def test_outside_the_regions_the_boundary_is_free():
    region = {"kind": "fix", "region": "u0", "data": "0;0;0"}
    assert dict(statement_of({"elasticity": {"regions": [region]}}))["traction σ n outside the regions below"] == "0"
    rows = dict(statement_of({"poisson": {"regions": [region], "exact": "x"}}))
    assert rows["flux κ ∂u/∂n outside the regions below"] == "from the exact solution"
    assert not any(name.endswith("on the boundary") for name in rows)


def test_regions_are_listed_where_there_are_some():
    region = {"kind": "load", "region": "nx > 0.9", "data": "0;0;-2", "area": 0.25}
    held = {"kind": "fix", "region": "u0", "data": "0;0;0"}
    head = ("condition", "on", "data", "area")
    row = ("load", "nx > 0.9", "0;0;-2", "0.25")
    assert regions_of({"elasticity": {"regions": [region]}}) == [head, row]
    assert regions_of({"elasticity": {}, "regions": [region]}) == [head, row]
    with_unit = regions_of({"elasticity": {"regions": [held], "unit": "mm"}})
    assert with_unit == [(*head[:3], "area [mm²]"), ("fix", "u0", "0;0;0", "")]
    assert regions_of({"elasticity": {}}) == regions_of({}) == []
