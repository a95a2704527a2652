"""Defines the training stages of section 4.3.1: their target shapes and their loss weights (paper, Table 1)."""

from dataclasses import dataclass, replace
from typing import Literal

from ..config import StageName

Target = Literal["S(2)", "S(1)", "cube"]


@dataclass(frozen=True)
class StageWeights:
    """Hold the weights of the loss terms in one stage, a row of the paper's Table 1; the defaults are its first row."""

    bij: float = 1e6
    arap: float = 1.0
    fair: float = 2e-3
    dist: float = 1e3
    norm: float = 10.0
    star: float = 1e3
    cor: float = 0.0
    edge: float = 0.0


@dataclass(frozen=True)
class Stage:
    """Hold the target shape of the mapped surface in a stage, and the weights of the loss."""

    target: Target
    weights: StageWeights


_FREE = StageWeights()
_HELD = StageWeights(dist=1e4, cor=1e3)
STAGES: dict[StageName, Stage] = {  # S(2) and S(1) are the paper's first stage
    "S(2)": Stage("S(2)", _FREE),
    "S(1)": Stage("S(1)", _FREE),
    "cube": Stage("cube", _FREE),
    "corners": Stage("cube", _HELD),
    "edges": Stage("cube", replace(_HELD, edge=1e4)),
}
