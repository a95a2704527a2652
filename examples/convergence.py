r"""h, p and k refinement
=====================

Rates on one fixed curved map, refined exactly: the three ways to enrich a spline space.

`python examples/convergence.py [--out DIR] [--levels N]` writes convergence.csv and convergence.png with h refinement
for the degrees 2 to 5, where the errors fall as :math:`h^{p+1}` in :math:`L^2` and :math:`h^p` in :math:`H^1`, and
orders.csv and orders.png, where the degree rises on a fixed mesh: with the smoothness kept (p refinement), and growing
with the degree (k refinement).
"""

from __future__ import annotations

import argparse
from pathlib import Path

from matplotlib.figure import Figure

import iga_nn
from iga_nn.figures.line_plots import draw_study
from iga_nn.level_table import Study, as_csv, as_table
from solve.study import benchmark_volume

PROBLEM = iga_nn.Poisson(exact="exp(x+z)*sin(y)")


def refine_h(degrees: tuple[int, ...], levels: int) -> Study:
    """The benchmark map of each degree on 4^3 elements, halved again and again."""
    return {p: iga_nn.convergence(benchmark_volume(4, p), PROBLEM, range(levels)) for p in degrees}


def raise_degree(degrees: tuple[int, ...], halvings: int = 2) -> dict[str, Study]:
    """The tricubic map of one element, on a mesh of 2^halvings elements a direction.

    Knots of the map itself keep its smoothness, C^2, in every degree: so p refinement starts from the halved map. Knots
    that belong to the trial space alone are as smooth as the degree allows: so k refinement halves the space.
    """
    volume = benchmark_volume(1)
    return {
        "p refinement, $C^2$": {p: iga_nn.convergence(volume.refined(halvings), PROBLEM, (0,), p) for p in degrees},
        "k refinement, $C^{p-1}$": {p: iga_nn.convergence(volume, PROBLEM, (halvings,), p) for p in degrees},
    }


def draw_orders(path: Path, orders: dict[str, Study]) -> None:
    """Relative L2 error over the number of unknowns, the degree beside each point."""
    figure = Figure(figsize=(6.5, 5), dpi=110, layout="constrained")
    axes = figure.subplots()
    for (name, study), marker in zip(orders.items(), "os", strict=True):
        reports = [rows[0].report for rows in study.values()]
        axes.loglog([r.dofs for r in reports], [r.l2_relative for r in reports], f"{marker}-", label=name)
        for degree, report in zip(study, reports, strict=True):
            axes.annotate(f"{degree}", (report.dofs, report.l2_relative), (6, 4), textcoords="offset points")
    axes.set_xticks([300, 1000, 3000], ["300", "1000", "3000"])
    axes.minorticks_off()
    axes.set_xlabel("unknowns")
    axes.set_ylabel("relative L2 error")
    axes.set_title("Raising the degree (at the points) on a fixed mesh")
    axes.grid(alpha=0.3, which="both")
    axes.legend(frameon=False)
    figure.savefig(path)


def main(argv: list[str] | None = None) -> dict[str, Study]:
    """Print the tables, write CSV and figures, and return the three studies by name."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/convergence"))
    parser.add_argument("--levels", type=int, default=4, help="of h refinement, from 4 elements a direction")
    parser.add_argument("--degrees", type=int, nargs="+", default=(2, 3, 4, 5))
    options = parser.parse_args(argv)
    options.out.mkdir(parents=True, exist_ok=True)
    h = refine_h(tuple(options.degrees), options.levels)
    orders = raise_degree((3, 4, 5, 6))
    for name, study in {"h refinement": h, **orders}.items():
        print(f"{name.replace('$', '')}\n{as_table(study)}\n")
    (options.out / "convergence.csv").write_text(as_csv(h), encoding="utf-8")
    (options.out / "orders.csv").write_text("\n".join(f"# {n}\n{as_csv(s)}" for n, s in orders.items()), "utf-8")
    draw_study(options.out / "convergence.png", h)
    draw_orders(options.out / "orders.png", orders)
    return {"h": h, **orders}


if __name__ == "__main__":
    main()
