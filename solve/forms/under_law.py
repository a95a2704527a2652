"""Defines UnderLaw: a problem whose loads and data are kept while another law makes the matrix."""

from typing import Any

from .boundary_value_problem import BoundaryValueProblem
from .form import Form


class UnderLaw:
    """State a problem under another law; what follows from an exact solution still follows from the problem's own."""

    def __init__(self, problem: BoundaryValueProblem, form: Form) -> None:
        self.problem, self.form = problem, form

    def __getattr__(self, name: str) -> Any:
        return getattr(self.problem, name)
