"""History: loss, folds and terms of every step of a run, as history.npz holds them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np


@dataclass
class History:
    """Loss, folded samples and unweighted terms of every step, over all stages."""

    rows: list[tuple[str, int, float, int, dict[str, float]]] = field(default_factory=list)

    def add(self, stage: str, step: int, loss: float, folded: int, terms: dict[str, float]) -> None:
        """Append a row."""
        self.rows.append((stage, step, loss, folded, terms))

    def arrays(self) -> dict[str, np.ndarray]:
        """Return columns of equal length, with NaN where a term is not used."""
        names = sorted({name for row in self.rows for name in row[4]})
        columns: dict[str, np.ndarray] = {
            "stage": np.array([row[0] for row in self.rows]),
            "step": np.array([row[1] for row in self.rows]),
            "loss": np.array([row[2] for row in self.rows]),
            "folded": np.array([row[3] for row in self.rows]),
        }
        for name in names:
            columns[name] = np.array([row[4].get(name, math.nan) for row in self.rows])
        return columns
