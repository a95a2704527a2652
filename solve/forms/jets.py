"""Defines jets: values that carry their derivatives through formulas and laws.

Value, gradient and Hessian are computed together by forward automatic differentiation (Griewank and Walther,
*Evaluating Derivatives*, 2nd ed., chapter 13), so a source -div flux(u) is exact. An array of jets is a NumPy array of
objects: NumPy's arithmetic and its functions sin, cos, tan, exp, log, sqrt, tanh and abs then act on each jet.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from parameterize.arrays import Array

from .trigonometry import sine_and_cosine

Number = float | Array  # constants stay NumPy scalars (a kind of float): products with 0.0 and 1.0 are then free
Numbers = tuple[Number, ...]
Jets = Any  # an array of jets, of dtype object
PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))  # the order of the six second derivatives
SYMMETRIC = ((0, 1, 2), (1, 3, 4), (2, 4, 5))  # place of a symmetric tensor's entry (i, j) among its six
ZERO = (0.0, 0.0, 0.0)  # the gradient of a constant: this very object
UNITS = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def _function(rule: Callable[[Any], tuple[Number, Number, Number]]) -> Callable[["Jet"], "Jet"]:
    """Return a method of `Jet`: a function h, from the rule for h, h' and h'' at a value."""
    return lambda jet: jet._chain(*rule(jet.value))


def _operation(rule: Callable[["Jet", "Jet"], "Jet"]) -> Callable[["Jet", Any], Any]:
    """Return a method of `Jet`: an operator, from the rule for two jets; the other operand may be a number."""

    def method(jet: "Jet", other: Any) -> Any:
        if isinstance(other, Jet):
            return rule(jet, other)
        # unlike a Python float, NumPy's overflows to inf and never turns complex
        return rule(jet, Jet(np.float64(other))) if isinstance(other, int | float | np.integer) else NotImplemented

    return method


@dataclass(frozen=True, eq=False)
class Jet:
    """Hold a function's value, gradient and Hessian (xx, xy, xz, yy, yz, zz) at the points of an array.

    Constant derivatives are scalars. Jets from variables without a Hessian have no Hessian, which saves its
    computation.
    """

    value: Number
    gradient: Numbers = ZERO
    hessian: Numbers = (0.0,) * 6

    @property
    def is_constant(self) -> bool:
        """Return whether this is a constant of a formula, whose derivatives take no arithmetic."""
        return self.gradient is ZERO

    def __neg__(self) -> "Jet":
        return self * -1.0

    def __pow__(self, other: Any) -> Any:
        if isinstance(other, int | float | np.integer):
            return self.power(float(other))
        return (other * self.log()).exp() if isinstance(other, Jet) else NotImplemented  # valid for a positive base

    @_operation
    def __add__(self, b: "Jet") -> "Jet":
        if self.is_constant or b.is_constant:
            varying = b if self.is_constant else self
            return Jet(_plus(self.value, b.value), varying.gradient, varying.hessian)
        gradient, hessian = _each(_plus, self.gradient, b.gradient), _each(_plus, self.hessian, b.hessian)
        return Jet(_plus(self.value, b.value), gradient, hessian)

    @_operation
    def __mul__(self, b: "Jet") -> "Jet":
        """Return the product: (a b)_ij = a b_ij + a_i b_j + a_j b_i + b a_ij."""
        if self.is_constant or b.is_constant:
            factor, varying = (self, b) if self.is_constant else (b, self)
            return varying._scaled(factor.value)

        def product(da: Number, db: Number) -> Number:
            return _plus(_times(self.value, db), _times(b.value, da))

        def mixed(second_a: Number, second_b: Number, pair: tuple[int, int]) -> Number:
            i, j = pair
            one, two = _times(self.gradient[i], b.gradient[j]), _times(self.gradient[j], b.gradient[i])
            return _plus(product(second_a, second_b), _plus(one, two))

        hessian = tuple(mixed(*entries) for entries in zip(self.hessian, b.hessian, PAIRS, strict=False))
        return Jet(self.value * b.value, _each(product, self.gradient, b.gradient), hessian)

    def _scaled(self, factor: Number) -> "Jet":
        """Return the product with a constant."""
        if self.is_constant:
            return Jet(self.value * factor)
        gradient = tuple(_times(factor, slope) for slope in self.gradient)
        return Jet(self.value * factor, gradient, tuple(_times(factor, second) for second in self.hessian))

    def power(self, n: float) -> "Jet":
        """Return a constant power; the factors n and n (n - 1) that vanish prevent 0 ** negative."""
        v = self.value
        first = n * v ** (n - 1.0) if n != 0.0 else 0.0
        second = n * (n - 1.0) * v ** (n - 2.0) if n not in (0.0, 1.0) else 0.0
        return self._chain(v**n, first, second)

    def __abs__(self) -> "Jet":
        """Return the absolute value.

        Derivatives hold away from the zeros of the argument; the source of a kink is not a function.
        """
        return self._chain(np.abs(self.value), np.sign(self.value), 0.0)

    sin = _function(lambda v: ((pair := sine_and_cosine(v))[0], pair[1], -pair[0]))
    cos = _function(lambda v: ((pair := sine_and_cosine(v))[1], -pair[0], -pair[1]))
    tan = _function(lambda v: ((t := np.tan(v)), (slope := 1.0 + t * t), 2.0 * t * slope))
    tanh = _function(lambda v: ((t := np.tanh(v)), (slope := 1.0 - t * t), -2.0 * t * slope))
    exp = _function(lambda v: ((value := np.exp(v)), value, value))
    log = _function(lambda v: (np.log(v), 1.0 / v, -1.0 / (v * v)))
    sqrt = _function(lambda v: ((root := np.sqrt(v)), 0.5 / root, -0.25 / (root * v)))

    __radd__, __rmul__ = __add__, __mul__
    __sub__ = _operation(lambda a, b: a + -b)
    __rsub__ = _operation(lambda a, b: -a + b)
    __truediv__ = _operation(lambda a, b: a * b.power(-1.0))
    __rtruediv__ = _operation(lambda a, b: a.power(-1.0) * b)
    __rpow__ = _operation(lambda a, b: (a * b.log()).exp())

    def _chain(self, value: Number, first: Number, second: Number) -> "Jet":
        """Return h(a) by the chain rule from h, h' and h'' at a: h(a)_ij = h' a_ij + h'' a_i a_j."""

        def entry(second_a: Number, pair: tuple[int, int]) -> Number:
            i, j = pair
            return _plus(_times(first, second_a), _times(second, _times(self.gradient[i], self.gradient[j])))

        gradient = tuple(_times(first, da) for da in self.gradient)
        return Jet(value, gradient, tuple(entry(*entries) for entries in zip(self.hessian, PAIRS, strict=False)))


def _plus(a: Number, b: Number) -> Number:
    if isinstance(a, float) and a == 0.0:
        return b
    return a if isinstance(b, float) and b == 0.0 else a + b


def _times(a: Number, b: Number) -> Number:
    for known, other in ((a, b), (b, a)):
        if isinstance(known, float) and known in (0.0, 1.0):
            return 0.0 if known == 0.0 else other
    return a * b


def _each(operation: Callable[[Number, Number], Number], a: Numbers, b: Numbers) -> Numbers:
    """Return the results of an operation entry by entry, as many as the shorter row has; an absent Hessian is empty."""
    return tuple(operation(*entries) for entries in zip(a, b, strict=False))


def coordinates(x: Sequence[Array] | Array, hessian: Numbers = ()) -> list[Jet]:
    """Return the jets of x, y, z at points (3, ...), with second derivatives where `hessian` is six zeros."""
    return [Jet(row, unit, hessian) for row, unit in zip(x, UNITS, strict=True)]


def stacked(rows: Sequence[Number], shape: tuple[int, ...]) -> Array:
    """Return rows, some of which may be constants, as one array (len(rows), *shape)."""
    full = np.empty((len(rows), *shape))
    for i, row in enumerate(rows):
        full[i] = row
    return full


def known(jets: Sequence[Jet], shape: tuple[int, ...]) -> tuple[Array, Array]:
    """Return values (c, *shape) and gradients (c, 3, *shape) of c jets as arrays."""
    gradients = stacked([slope for jet in jets for slope in jet.gradient], shape)
    return stacked([jet.value for jet in jets], shape), gradients.reshape(-1, 3, *shape)
