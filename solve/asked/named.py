"""Finds quantities of one number a point by the names that asks use: components, and what a law names."""

import math
import re
from typing import Any

import numpy as np

from ..answer import Dimension
from ..ask import Ask
from ..forms.boundary_value_problem import BoundaryValueProblem
from ..forms.elasticity import Elasticity
from ..forms.form import Form, Quantity

AXES = "xyz"
_COMPONENT = re.compile(r"(?P<whole>\w+)_(?P<axes>[xyz]{1,2})")
_STRESSES = {"von_mises", "pressure", "first_principal", "third_principal", "stress", "flux", "flux_magnitude"}
_LENGTHS = {"ux", "uy", "uz", "magnitude"}
_OF_KINDS: dict[str, Dimension] = {"reaction": "force", "flow": "force", "energy": "energy", "frequency": "frequency"}


def named(form: Form, name: str) -> Quantity:
    """Return a quantity of one number a point of a law. Raises ValueError for a name that the law does not have."""
    if name in own_names(form):
        part = 0 if form.components == 1 else AXES.index(name[1])
        return lambda u, grad, x: u[part]
    given = form.quantities
    if name in given:
        return given[name]
    found = _COMPONENT.fullmatch(name)
    if found is None or found["whole"] not in given:
        known = ", ".join(dict.fromkeys((*own_names(form), *given)))
        raise ValueError(f"{type(form).__name__} gives no {name!r}; it gives {known}, and components such as flux_x")
    whole, axes = given[found["whole"]], tuple(map(AXES.index, found["axes"]))

    def component(u: Any, grad: Any, x: Any) -> Any:
        values = np.asarray(whole(u, grad, x))
        lead = values.shape[: values.ndim - (np.ndim(x) - 1)]
        place = (0, *axes) if lead == (1, 3) else axes  # of a scalar law
        if len(place) != len(lead) or any(i >= n for i, n in zip(place, lead, strict=True)):
            raise ValueError(f"{found['whole']} has the shape {lead} at a point: there is no {name}")
        return values[place]

    return component


def own_names(form: Form) -> tuple[str, ...]:
    """Return the names of the components of u."""
    return {1: ("u", "T"), 3: ("ux", "uy", "uz")}.get(form.components, ())


def demand_fit(ask: Ask, problem: BoundaryValueProblem) -> None:
    """Raise ValueError where an ask is not one of a problem's law: another name, a vector, a direction that lacks."""
    form, law = problem.form, type(problem.form).__name__
    if ask.kind == "frequency":
        raise ValueError(f"{ask.role}: frequencies are those of modes: ask iga_nn.modes, or `iga-nn modes --ask`")
    if ask.kind == "energy" and not form.symmetric:
        raise ValueError(f"{ask.role}: {law} is not symmetric, and a law that is not has no energy 1/2 a(u, u)")
    if ask.kind in ("reaction", "flow"):
        if (form.components == 3) != bool(ask.direction):
            write = f"{ask.kind} x, y or z" if form.components == 3 else f"{ask.kind} without a direction"
            raise ValueError(f"{ask.role}: u has {form.components} components: write {write}")
        if not ask.is_on_boundary and ask.kind == "flow":
            raise ValueError(
                f"{ask.role}: {str(ask.region)!r} is a part of the body: a flow passes a part of its boundary"
            )
    if ask.quantity:
        _demand_number(ask, form)


def _demand_number(ask: Ask, form: Form) -> None:
    """Raise ValueError where an ask's quantity is unknown, or is not one number a point."""
    try:
        quantity = named(form, ask.quantity)
    except ValueError as error:
        raise ValueError(f"{ask.role}: {error}") from None
    c, m = form.components, 2
    try:
        found = np.shape(quantity(np.ones((c, m)), np.ones((c, 3, m)), np.ones((3, m))))
    except ValueError as error:
        if "there is no" in str(error):
            raise ValueError(f"{ask.role}: {error}") from None
        return
    except Exception:  # whatever a law does that needs more than plain arrays
        return
    extra = found[:-1] if found and found[-1] == m else ()
    if math.prod(extra) != 1 or len(extra) > 1:
        names = ", ".join(own_names(form)) + ", magnitude" if ask.quantity == "u" else _components(ask.quantity, extra)
        raise ValueError(f"{ask.role}: {ask.quantity} has {math.prod(extra)} numbers a point; ask for one: {names}")


def _components(name: str, shape: tuple[int, ...]) -> str:
    """Return examples of the components of a quantity of some shape a point."""
    if name == "principal":
        return "first_principal or third_principal"
    return f"{name}_x, {name}_y or {name}_z" if shape == (1, 3) else f"such as {name}_xx or {name}_xy"


def dimension_of(ask: Ask, form: Form) -> Dimension:
    """Return what an asked quantity measures; "" for a law whose units are unknown."""
    if ask.kind == "frequency":
        return "frequency"
    if not isinstance(form, Elasticity) or ask.kind == "integral":
        return ""
    if ask.kind in _OF_KINDS:
        return _OF_KINDS[ask.kind]
    whole = ask.quantity if ask.quantity in _STRESSES else ask.quantity.rpartition("_")[0]
    return "stress" if whole in _STRESSES else "length" if ask.quantity in _LENGTHS else ""
