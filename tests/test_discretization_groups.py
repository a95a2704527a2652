"""Patches of one shape are one array: the same numbers as patch by patch."""

import numpy as np
import pytest
from cube_grids import row_of

import iga_nn
from solve.discretization.error_norms import Compared, error_norms
from solve.discretization.group_kernels import multiply_patches
from solve.discretization.groups import CoefficientLayout
from solve.discretization.lane_kernels import multiply_small
from solve.discretization.operator import assemble
from solve.discretization.space import trial_space
from solve.patch_system import operators_of


def test_patches_of_one_shape_stand_side_by_side():
    spaces = [trial_space(volume) for volume in row_of((3, 4, 3, 3)).patches]
    layout = CoefficientLayout.of(spaces)
    assert layout.groups == ((0, 2, 3), (1,))
    parts = [np.random.default_rng(i).standard_normal((2, *space.shape)) for i, space in enumerate(spaces)]
    joined = layout.joined(parts)
    assert layout.joined(joined) is joined
    assert all(np.array_equal(*pair) for pair in zip(joined, parts, strict=True))
    first, second = joined.in_groups
    assert np.array_equal(first, np.stack([parts[0], parts[2], parts[3]], axis=0))
    second += 1.0
    assert np.array_equal(joined[1], parts[1] + 1.0)  # no copy
    assert [part.shape for part in joined[2:]] == [part.shape for part in parts[2:]]


@pytest.mark.parametrize(
    "problem",
    [
        iga_nn.Poisson(source="1", kappa={0: "1+x", 1: 2, 2: 3, 3: 1}, reaction="x", robin={"v1": ("2", "0")}),
        iga_nn.Elasticity(body_force=("0", "0", "1"), young={0: 1, 1: 2, 2: 3, 3: 4}, fix="x < 0.1", spring={"v1": 3}),
    ],
)
def test_a_body_multiplies_as_its_patches_do(problem):
    system = iga_nn.discretize(row_of((3, 4, 3, 3)), problem)
    x = np.random.default_rng(0).standard_normal((system.problem.form.components, *system.unknowns.shape))
    on_patches = system.unknowns.spread(x)
    each = [patch.matrix.apply(own) for patch, own in zip(system.patches, on_patches, strict=True)]
    products = system.matrix.layout.joined(each)
    for face in system.matrix.shared_faces:
        total = np.zeros_like(products.of(face.patches))
        face.add_product(on_patches.of(face.patches), total)
        products.add(face.patches, total)
    expected = system.unknowns.collect(products)
    assert len(system.matrix.stacks) == 1 and len(system.matrix.alone) == 1
    assert system.product(x) == pytest.approx(expected, rel=1e-12, abs=1e-12 * np.abs(expected).max())


def test_patches_share_the_arrays_of_their_stack():
    system = iga_nn.discretize(row_of((3, 3)), iga_nn.Poisson(source="1"))
    (stack,) = system.matrix.stacks
    assert all(np.shares_memory(stack.factors, patch.matrix.factors) for patch in system.patches)


@pytest.mark.parametrize(
    "problem",
    [
        iga_nn.Poisson(source="x*y", kappa={0: "1+x", 1: "1+x", 2: 2, 3: "1+x"}, reaction="x"),
        iga_nn.Elasticity(body_force=("0", "x", "1"), young={0: 1, 1: 2, 2: 1, 3: 1}, displacement=("0", "0", "0")),
        iga_nn.Problem(iga_nn.Poisson(source="0", kappa="1+y"), source=lambda x: x[0] * x[1]),
    ],
)
def test_a_stack_is_assembled_as_its_patches_are(problem):
    body = row_of((3, 3, 3, 3))
    system = iga_nn.discretize(body, problem)
    assert len(system.matrix.stacks) == 1 and not system.matrix.alone
    placed = problem.on(body).on_patches(body)
    every = operators_of(system.matrix, problem.form.components)
    for patch, own, blocks in zip(system.patches, placed, every, strict=True):
        how = {"rule": patch.matrix.rule, "component": patch.matrix.component if own.form.components == 1 else None}
        matrix, load = assemble(patch.volume, patch.space, own.form, own.source_at, **how)
        name = "factors" if own.form.components == 1 else "rows"
        assert np.allclose(getattr(matrix, name), getattr(patch.matrix, name), rtol=1e-12, atol=1e-15)
        assert np.allclose(load, patch.loads, rtol=1e-12, atol=1e-15)
        assert np.allclose(
            blocks[-1].diagonal(),
            matrix_diagonal(patch, own),
            rtol=1e-12,
            atol=1e-15,
        )


def matrix_diagonal(patch, problem):
    """Return the diagonal of the last component's block, assembled on the patch alone."""
    last = problem.form.components - 1
    return assemble(patch.volume, patch.space, problem.form, rule=patch.matrix.rule, component=last)[0].diagonal()


@pytest.mark.parametrize("counts", [(3, 3, 3), (3, 4, 3)])
def test_errors_of_a_body_are_those_of_its_patches(counts):
    body = row_of(counts)
    fields = iga_nn.solve(body, iga_nn.Poisson(source="1")).patches
    problem = iga_nn.Poisson(exact="sin(x)*y")
    parts = [
        Compared(one.geometry, trial_space(one.geometry), one.coefficients[None], problem.exact_at, "one")
        for one in fields
    ]
    whole, each = error_norms(parts), [error_norms([part]) for part in parts]
    assert whole.l2**2 == pytest.approx(sum(one.l2**2 for one in each), rel=1e-12)
    assert whole.h1_seminorm**2 == pytest.approx(sum(one.h1_seminorm**2 for one in each), rel=1e-12)
    size = sum((one.h1_seminorm / one.h1_relative) ** 2 for one in each) ** 0.5
    assert whole.h1_relative == pytest.approx(whole.h1_seminorm / size, rel=1e-12)


class Windy(iga_nn.Form):
    """A law that is not symmetric, with u in its flux."""

    symmetric = False

    def flux(self, u, grad, x):
        return np.stack([grad[:, 0] + 0.3 * grad[:, 1] + 0.2 * u, grad[:, 1] - 0.1 * grad[:, 0], grad[:, 2]], axis=1)


ON_FACES = {
    "weak": iga_nn.Elasticity(fix="x < 0.2 and z < 0.6", roller="w1", spring={"y > 0.9 and x > 1": 3.0}),
    "robin": iga_nn.Poisson(source="1", neumann={"w0": "0"}, robin={"v1": ("2", "0")}),
    "not symmetric": iga_nn.Problem(
        Windy(), source="1", conditions=[iga_nn.Value("x < 0.3", "1"), iga_nn.Exchange("z > 0.9 and x > 1", 2.0, 1.0)]
    ),
}


@pytest.mark.parametrize("problem", ON_FACES.values(), ids=ON_FACES)
def test_the_matrix_of_terms_on_faces_is_that_of_their_products(problem):
    matrix = iga_nn.discretize(row_of((3, 4, 3)), problem).matrix
    x = matrix.layout.empty(problem.form.components)
    x.flat[:] = np.random.default_rng(0).standard_normal(x.flat.shape)
    found, expected = 0.0 * x, 0.0 * x
    matrix.add_faces(x, found)
    for face in matrix.faces:
        total = np.zeros_like(x.of(face.patches))
        face.add_product(x.of(face.patches), total)
        expected.add(face.patches, total)
    assert np.abs(expected.flat).max() > 0.01
    assert found.flat == pytest.approx(expected.flat, abs=1e-12 * np.abs(expected.flat).max())


@pytest.mark.parametrize("count", [2, 3, 11])
def test_lanes_multiply_as_rows_of_points_do(count):
    """One block of lanes, a full one with the start of another, and too few patches for lanes."""
    system = iga_nn.discretize(row_of((3,) * count), iga_nn.Poisson(source="1", kappa="1+x*y", reaction="z"))
    (matrix,) = system.matrix.stacks
    coefficients = np.random.default_rng(0).standard_normal((count, 2, *matrix.stack.space.shape))
    results = np.zeros_like(coefficients), np.zeros_like(coefficients)
    stack, numbers = matrix.stack, np.arange(count)
    for kernel, result in zip((multiply_small, multiply_patches), results, strict=True):
        where = matrix.places, numbers, np.arange(stack.shape[0]), stack.kinds, stack.tables, matrix.factors
        kernel(coefficients, *where, result)
    assert results[0] == pytest.approx(results[1], rel=1e-12, abs=1e-13)
