"""Defines UnderLaw: a problem whose loads and data are kept while another law makes the matrix."""

from collections.abc import Sequence
from typing import Any

from .boundary_value_problem import BoundaryValueProblem
from .conditions import Condition
from .form import Form


class UnderLaw:
    """State a problem under another law; what follows from an exact solution still follows from the problem's own."""

    def __init__(self, problem: BoundaryValueProblem, form: Form) -> None:
        self.problem, self.form = problem, form

    def sharing(self, conditions: Sequence[Condition]) -> "UnderLaw":
        """Return the same, with what totals come to at each point."""
        return UnderLaw(self.problem.sharing(conditions), self.form)

    def nominal(self) -> "UnderLaw":
        """Return the same, whose totals have some field of their kind where they have none yet."""
        return UnderLaw(self.problem.nominal(), self.form)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.problem, name)
