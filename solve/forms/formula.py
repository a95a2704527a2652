"""Formulas a user types, such as "exp(X+Z)*sin(Y)": parsed by a whitelist, evaluated on arrays with derivatives.

x, y, z are coordinates in the user's units; X, Y, Z are the same scaled to a body of volume 1 (`frame.UnitFrame`).
Nothing is ever passed to eval or exec. Python's own parser makes the tree; every node is then checked against the few
kinds allowed and translated. Value, gradient and Hessian follow together by forward automatic differentiation
(Griewank and Walther, *Evaluating Derivatives*, 2nd ed., chapter 13), so a source -div(kappa grad u) is exact.
"""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from parameterize.arrays import Array

from .frame import UnitFrame

Number = float | Array  # constants stay NumPy scalars (a kind of float): products with 0.0 and 1.0 are then free
Numbers = tuple[Number, ...]
PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))  # the order of the six second derivatives

MAX_LENGTH = 1000
MAX_DEPTH = 100
MAX_EXPONENT = 64
COORDINATES = ("x", "y", "z")
SCALED = ("X", "Y", "Z")
VARIABLES = (*COORDINATES, *SCALED)
CONSTANTS = {"pi": math.pi, "e": math.e}
OPERATORS = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "**"}


class ExpressionError(ValueError):
    """A formula that is refused, or data that are not finite somewhere on the domain."""


@dataclass(frozen=True, eq=False)
class Jet:
    """A function's value, gradient and Hessian (xx, xy, xz, yy, yz, zz) at the points of an array.

    What is constant is a scalar. Variables seeded without Hessian carry none, and no work is spent on it.
    """

    value: Number
    gradient: Numbers = (0.0, 0.0, 0.0)
    hessian: Numbers = (0.0,) * 6


def _plus(a: Number, b: Number) -> Number:
    if isinstance(a, float) and a == 0.0:
        return b
    return a if isinstance(b, float) and b == 0.0 else a + b


def _times(a: Number, b: Number) -> Number:
    for known, other in ((a, b), (b, a)):
        if isinstance(known, float) and known in (0.0, 1.0):
            return 0.0 if known == 0.0 else other
    return a * b


def _combine(operation: Callable[..., Number], *rows: Numbers) -> Numbers:
    """Apply an operation entry by entry; the shortest row, a Hessian left out, decides how many there are."""
    return tuple(operation(*entries) for entries in zip(*rows, strict=False))


def _add(a: Jet, b: Jet) -> Jet:
    return Jet(a.value + b.value, _combine(_plus, a.gradient, b.gradient), _combine(_plus, a.hessian, b.hessian))


def _scale(factor: float, a: Jet) -> Jet:
    gradient, hessian = (_combine(lambda da: _times(factor, da), row) for row in (a.gradient, a.hessian))
    return Jet(factor * a.value, gradient, hessian)


def _multiply(a: Jet, b: Jet) -> Jet:
    """Product rule: (a b)_ij = a b_ij + a_i b_j + a_j b_i + b a_ij."""

    def product(da: Number, db: Number) -> Number:
        return _plus(_times(a.value, db), _times(b.value, da))

    def mixed(second_a: Number, second_b: Number, pair: tuple[int, int]) -> Number:
        i, j = pair
        one, other = _times(a.gradient[i], b.gradient[j]), _times(a.gradient[j], b.gradient[i])
        return _plus(product(second_a, second_b), _plus(one, other))

    hessian = tuple(mixed(*entries) for entries in zip(a.hessian, b.hessian, PAIRS, strict=False))
    return Jet(a.value * b.value, _combine(product, a.gradient, b.gradient), hessian)


def _chain(a: Jet, value: Number, first: Number, second: Number) -> Jet:
    """Chain rule for h(a) from h, h' and h'' at a: h(a)_ij = h' a_ij + h'' a_i a_j."""

    def entry(second_a: Number, pair: tuple[int, int]) -> Number:
        i, j = pair
        return _plus(_times(first, second_a), _times(second, _times(a.gradient[i], a.gradient[j])))

    gradient = _combine(lambda da: _times(first, da), a.gradient)
    return Jet(value, gradient, tuple(entry(*entries) for entries in zip(a.hessian, PAIRS, strict=False)))


def _raise_to(a: Jet, n: float) -> Jet:
    """Raise a to a constant power; the factors n and n (n - 1) that vanish keep 0 ** negative out."""
    v = a.value
    first = n * v ** (n - 1.0) if n != 0.0 else 0.0
    second = n * (n - 1.0) * v ** (n - 2.0) if n not in (0.0, 1.0) else 0.0
    return _chain(a, v**n, first, second)


def _tanh(a: Jet) -> Jet:
    t = np.tanh(a.value)
    slope = 1.0 - t * t
    return _chain(a, t, slope, -2.0 * t * slope)


def _tan(a: Jet) -> Jet:
    t = np.tan(a.value)
    slope = 1.0 + t * t
    return _chain(a, t, slope, 2.0 * t * slope)


def _exp(a: Jet) -> Jet:
    value = np.exp(a.value)
    return _chain(a, value, value, value)


def _sqrt(a: Jet) -> Jet:
    root = np.sqrt(a.value)
    return _chain(a, root, 0.5 / root, -0.25 / (root * a.value))


def _sin(a: Jet) -> Jet:
    sine = np.sin(a.value)
    return _chain(a, sine, np.cos(a.value), -sine)


def _cos(a: Jet) -> Jet:
    cosine = np.cos(a.value)
    return _chain(a, cosine, -np.sin(a.value), -cosine)


def _log(a: Jet) -> Jet:
    return _chain(a, np.log(a.value), 1.0 / a.value, -1.0 / (a.value * a.value))


def _abs(a: Jet) -> Jet:
    """Derivatives hold away from the zeros of the argument; the source of a kink is not a function."""
    return _chain(a, np.abs(a.value), np.sign(a.value), 0.0)


FUNCTIONS: dict[str, Callable[[Jet], Jet]] = {
    "sin": _sin,
    "cos": _cos,
    "tan": _tan,
    "exp": _exp,
    "log": _log,
    "sqrt": _sqrt,
    "tanh": _tanh,
    "abs": _abs,
}

Evaluator = Callable[[Sequence[Jet]], Jet]  # of the six variables


@dataclass(frozen=True)
class Expression:
    """A formula in x, y, z and X, Y, Z.

    frame: what X, Y, Z mean; a formula with one of them cannot be evaluated without it (`placed`).
    variables: those that occur in the formula.
    Raises ExpressionError, naming the place, for anything outside the whitelist.
    """

    text: str
    frame: UnitFrame | None = None
    variables: frozenset[str] = field(init=False, repr=False, compare=False)
    _evaluate: Evaluator = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        translator = _Translator(self.text)
        object.__setattr__(self, "variables", frozenset(translator.variables))
        object.__setattr__(self, "_evaluate", translator.result)

    @property
    def is_scaled(self) -> bool:
        """Whether X, Y or Z occurs in the formula."""
        return not self.variables.isdisjoint(SCALED)

    @property
    def scaled_text(self) -> str | None:
        """The formula with X, Y, Z in place of x, y, z; None where none of these occurs."""
        if self.variables.isdisjoint(COORDINATES):
            return None
        return re.sub(r"\b[xyz]\b", lambda match: match.group().upper(), self.text)

    def placed(self, frame: UnitFrame) -> Expression:
        """The same formula with X, Y, Z measured in this frame."""
        return replace(self, frame=frame)

    def __call__(self, x: ArrayLike, y: ArrayLike, z: ArrayLike) -> Array:
        """Values at points given by arrays of equal shape."""
        points = _coordinates(x, y, z)
        with np.errstate(all="ignore"):
            jet = self._evaluate(self._seeds([Jet(point) for point in points]))
        return np.broadcast_to(np.asarray(jet.value), points[0].shape)

    def gradient(self, x: ArrayLike, y: ArrayLike, z: ArrayLike) -> tuple[Array, Array]:
        """Value (...) and gradient (3, ...) at points given by arrays of equal shape."""
        value, gradient, _ = self._derivatives((), x, y, z)
        return value, gradient

    def hessian(self, x: ArrayLike, y: ArrayLike, z: ArrayLike) -> tuple[Array, Array, Array]:
        """Value (...), gradient (3, ...) and Hessian (6, ...) at points given by arrays of equal shape.

        The order of the second derivatives is xx, xy, xz, yy, yz, zz.
        """
        return self._derivatives((0.0,) * 6, x, y, z)

    def _derivatives(self, seconds: Numbers, x: ArrayLike, y: ArrayLike, z: ArrayLike) -> tuple[Array, Array, Array]:
        points = _coordinates(x, y, z)
        units = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
        seeds = [Jet(point, unit, seconds) for point, unit in zip(points, units, strict=True)]
        with np.errstate(all="ignore"):
            jet = self._evaluate(self._seeds(seeds))
        shape = points[0].shape
        value = np.broadcast_to(np.asarray(jet.value), shape)
        return value, _stacked(jet.gradient, shape), _stacked(jet.hessian[: len(seconds)], shape)

    def _seeds(self, coordinates: list[Jet]) -> list[Jet]:
        """The jets of the variables: of X, Y, Z only where they occur. Raises ExpressionError where they mean nothing.

        (x - c) / L has the gradient 1 / L.
        """
        if not self.is_scaled:
            return coordinates
        if self.frame is None:
            raise ExpressionError(
                f"{_shorten(self.text)!r}: X, Y, Z are scaled by the size of a volume: name it with problem.on(volume)"
            )
        scale = np.float64(1.0 / self.frame.length)
        shifted = [_add(x, Jet(np.float64(-c))) for x, c in zip(coordinates, self.frame.center, strict=True)]
        return [*coordinates, *(_scale(scale, x) for x in shifted)]


def _stacked(rows: Numbers, shape: tuple[int, ...]) -> Array:
    """Rows, constants among them, as one array (len(rows), *shape)."""
    full = np.empty((len(rows), *shape))
    for i, row in enumerate(rows):
        full[i] = row
    return full


def _coordinates(x: ArrayLike, y: ArrayLike, z: ArrayLike) -> list[Array]:
    return list(np.broadcast_arrays(*(np.asarray(c, dtype=np.float64) for c in (x, y, z))))


def _shorten(text: str, length: int = 40) -> str:
    return text if len(text) <= length else text[: length - 3] + "..."


class _Translator:
    """Turns a text into nested closures over jets, refusing what is not on the list."""

    def __init__(self, text: str) -> None:
        if not isinstance(text, str):
            raise ExpressionError(f"an expression must be text, got {type(text).__name__}")
        self.text = text.strip()
        self.variables: set[str] = set()
        if not self.text:
            raise ExpressionError("the expression is empty; write a formula such as exp(X+Z)*sin(Y)")
        if len(self.text) > MAX_LENGTH:
            raise ExpressionError(f"the expression has {len(self.text)} characters; at most {MAX_LENGTH} are allowed")
        self._check_brackets()
        try:
            tree = ast.parse(self.text, mode="eval")
        except SyntaxError as error:
            column = f", column {error.offset}" if error.offset else ""
            hint = "; a product is written with *, as in 2*x" if "decimal literal" in error.msg else ""
            raise ExpressionError(f"expression{column}, {_shorten(self.text)!r}: {error.msg}{hint}") from None
        except (ValueError, MemoryError, RecursionError) as error:
            raise ExpressionError(f"expression, {_shorten(self.text)!r}: cannot be parsed ({error})") from None
        self.result = self._node(tree.body, 1)

    def _check_brackets(self) -> None:
        """Bound the nesting before Python's parser sees the text."""
        depth = 0
        for column, character in enumerate(self.text, 1):
            depth += (character == "(") - (character == ")")
            if depth > MAX_DEPTH:
                raise ExpressionError(f"expression, column {column}: more than {MAX_DEPTH} nested parentheses")

    def _refuse(self, node: ast.expr, why: str) -> ExpressionError:
        place = _shorten(ast.get_source_segment(self.text, node) or "")
        return ExpressionError(f"expression, column {node.col_offset + 1}, {place!r}: {why}")

    def _node(self, node: ast.expr, depth: int) -> Evaluator:
        if depth > MAX_DEPTH:
            raise self._refuse(node, f"nested more than {MAX_DEPTH} deep")
        if isinstance(node, ast.Constant):
            return self._number(node)
        if isinstance(node, ast.Name):
            return self._name(node)
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            inner = self._node(node.operand, depth + 1)
            return lambda p: _scale(-1.0, inner(p))
        if isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
            return self._binary(node, depth)
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.BitXor):
            raise self._refuse(node, "a power is written with **, as in x**2")
        if isinstance(node, ast.Call):
            return self._call(node, depth)
        raise self._refuse(node, f"not allowed; use numbers, x y z X Y Z pi e, + - * / ** and {' '.join(FUNCTIONS)}")

    def _number(self, node: ast.Constant) -> Evaluator:
        if type(node.value) not in (int, float):
            raise self._refuse(node, "only real numbers are allowed")
        try:
            number = float(node.value)  # type: ignore[arg-type]
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            raise self._refuse(node, "the number is too large")
        constant = Jet(np.float64(number))  # unlike a Python float it overflows to inf and never turns complex
        return lambda p: constant

    def _name(self, node: ast.Name) -> Evaluator:
        if node.id in VARIABLES:
            index = VARIABLES.index(node.id)
            self.variables.add(node.id)
            return lambda p: p[index]
        if node.id in CONSTANTS:
            constant = Jet(np.float64(CONSTANTS[node.id]))
            return lambda p: constant
        raise self._refuse(node, f"unknown name; the names are {', '.join((*VARIABLES, *CONSTANTS, *FUNCTIONS))}")

    def _call(self, node: ast.Call, depth: int) -> Evaluator:
        if not isinstance(node.func, ast.Name) or node.func.id not in FUNCTIONS:
            raise self._refuse(node.func, f"not a known function; the functions are {', '.join(FUNCTIONS)}")
        if len(node.args) != 1 or node.keywords:
            raise self._refuse(node, f"{node.func.id} takes exactly one argument")
        function, inner = FUNCTIONS[node.func.id], self._node(node.args[0], depth + 1)
        return lambda p: function(inner(p))

    def _binary(self, node: ast.BinOp, depth: int) -> Evaluator:
        left, right = self._node(node.left, depth + 1), self._node(node.right, depth + 1)
        match OPERATORS[type(node.op)]:
            case "+":
                return lambda p: _add(left(p), right(p))
            case "-":
                return lambda p: _add(left(p), _scale(-1.0, right(p)))
            case "*":
                return lambda p: _multiply(left(p), right(p))
            case "/":
                return lambda p: _multiply(left(p), _raise_to(right(p), -1.0))
            case _:
                return self._power(node, left, right)

    def _power(self, node: ast.BinOp, left: Evaluator, right: Evaluator) -> Evaluator:
        if any(isinstance(part, ast.Name) and part.id in VARIABLES for part in ast.walk(node.right)):
            return lambda p: _exp(_multiply(right(p), _log(left(p))))  # valid for a positive base
        with np.errstate(all="ignore"):
            exponent = float(right([]).value)  # no variable in it
        if not abs(exponent) <= MAX_EXPONENT:
            raise self._refuse(node.right, f"the exponent must lie between -{MAX_EXPONENT} and {MAX_EXPONENT}")
        return lambda p: _raise_to(left(p), exponent)
