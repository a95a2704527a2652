"""Spans where they count
======================

The same edge that points inward as in `l_shape.py`. Uniform spans gain little there, whatever their degree. `adaptive`
halves the spans that miss the most: towards the edge and across it, none along it. The error then falls as fast as that
of a smooth solution.

`python examples/graded_spans.py`
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from l_shape import PLACES, singular
from matplotlib.figure import Figure

import iga_nn

DEGREE = 2


def main(out: str | Path = "out/graded_spans", accuracy: float = 0.003, levels: int = 4) -> Path:
    """Print the errors of uniform and of graded spans, and draw both; returns the picture."""
    cubes = [
        iga_nn.BSplineVolume.from_function(lambda u, v, w, x=x, y=y: (x + u, y + v, 0.5 * w), 2, 1) for x, y in PLACES
    ]
    body = iga_nn.Body.from_patches(cubes)
    edge = iga_nn.Poisson(exact=singular, source="0", neumann={"w0": "0", "w1": "0"})
    uniform = [iga_nn.solve(body, edge, degree=DEGREE, refine=level).report for level in range(1, levels + 1)]
    found = iga_nn.adaptive(body, edge, accuracy, degree=DEGREE)
    graded = [step.solution.report for step in found.steps]
    figure = Figure(figsize=(8.0, 4.0), dpi=110, layout="constrained")
    errors, plan = figure.subplots(1, 2)
    for name, reports in (("uniform", uniform), ("graded", graded)):
        for report in reports:
            print(f"{name:8s} {report.dofs:6d} unknowns, relative L2 error {report.l2_relative:.2e}")
        errors.loglog([one.dofs for one in reports], [one.l2_relative for one in reports], "o-", label=name)
    print(found.steps[-1].grading.spans, "spans;", str(found).splitlines()[-1])
    errors.set(xlabel="unknowns", ylabel="relative L2 error", title=f"degree {DEGREE}")
    errors.grid(alpha=0.3)
    errors.legend(frameon=False)
    for (x, y), patch in zip(PLACES, found.solution.patches, strict=True):
        u, v = (np.unique(knots) for knots in patch.knots[:2])
        plan.hlines(y + v, x, x + 1, lw=0.5, color="tab:orange")
        plan.vlines(x + u, y, y + 1, lw=0.5, color="tab:orange")
    plan.set(title="spans, seen along the edge", aspect="equal", xticks=[], yticks=[])
    plan.axis("off")
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    figure.savefig(folder / "graded_spans.png")
    return folder / "graded_spans.png"


if __name__ == "__main__":
    main()
