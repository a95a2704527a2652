"""A sample surface, parameterized and solved: the package in ten lines of Python."""

from __future__ import annotations

import iga_nn


def main(name: str = "bean", config: object = None, levels: int = 2) -> None:
    """Print quality, errors and convergence; `config` (see iga_nn.preset) shortens the run."""
    surface = iga_nn.sample(name)  # or iga_nn.load_surface("conch.obj")
    result = iga_nn.parameterize(surface, config, seed=0)
    print(result.quality)
    problem = iga_nn.Poisson(exact="exp(x+z)*sin(y)")  # source and boundary data follow
    solution = iga_nn.solve(result.volume, problem, certified=result.certificate.verdict)
    print(solution.report)
    for row in iga_nn.convergence(result.volume, problem, refine=range(levels)):
        print(row)


if __name__ == "__main__":
    main()
