"""Parses formulas that a user types, such as "exp(X+Z)*sin(Y)", by a whitelist, for arrays and for jets.

x, y, z are coordinates in the user's units; X, Y, Z are the same scaled to a body of volume 1 (`frame.UnitFrame`). No
text is ever passed to eval or exec. Python's own parser makes the tree; every node is then compared with the few
allowed kinds and translated.
"""

import ast
import functools
import math
import operator
import re
import sys
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from parameterize.arrays import Array

from .frame import UnitFrame
from .jets import Jet

MAX_LENGTH = 1000
MAX_DEPTH = 100
MAX_EXPONENT = 64
COORDINATES = ("x", "y", "z")
SCALED = ("X", "Y", "Z")
VARIABLES = (*COORDINATES, *SCALED)
CONSTANTS = {"pi": math.pi, "e": math.e}
OPERATORS: dict[type[ast.operator], Callable[[Jet, Jet], Jet]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
FUNCTIONS: dict[str, Callable[[Jet], Jet]] = {
    **{name: getattr(Jet, name) for name in ("sin", "cos", "tan", "exp", "log", "sqrt", "tanh")},
    "abs": abs,
}
CHOICES = {"min": 2, "max": 2, "where": 3}  # functions that choose among values -> number of their arguments
Comparison = Callable[[Any, Any, Any], Any]
LEAST = 1e-3  # of a tolerance: "x < 1e-9", which means x = 0, holds there on bodies of any usual size
COMPARISONS: dict[type[ast.cmpop], Comparison] = {  # of two numbers and their tolerance
    ast.Lt: lambda a, b, near: a < b - LEAST * near,
    ast.LtE: lambda a, b, near: a <= b + near,
    ast.Gt: lambda a, b, near: a > b + LEAST * near,
    ast.GtE: lambda a, b, near: a >= b - near,
}

Values = Sequence[Any]  # of the variables, jets; where conditions have names, Boolean arrays of these after them
Evaluator = Callable[[Values], Jet]
Decider = Callable[[Values], Any]  # gives Boolean arrays
Tolerance = Callable[[Jet, Jet], Any]  # of two numbers that are compared


class ExpressionError(ValueError):
    """A formula that is refused, or data that are not finite somewhere on the domain.

    Examples
    --------
    >>> import iga_nn, solve
    >>> try:
    ...     iga_nn.Poisson(exact="import os")
    ... except solve.ExpressionError as error:
    ...     print("refused")
    refused
    """


@dataclass(frozen=True)
class Expression:
    """A formula in x, y, z and X, Y, Z.

    frame: the meaning of X, Y, Z; a formula with one of them cannot be evaluated without it (`placed`).
    variables: those that occur in the formula. is_smooth: whether it is without where, min and max, whose results bend
        or jump: no source follows from such a formula.
    Raises ExpressionError, naming the place, for anything outside the whitelist.
    """

    text: str
    frame: UnitFrame | None = None
    variables: frozenset[str] = field(init=False, repr=False, compare=False)
    is_smooth: bool = field(init=False, repr=False, compare=False)
    _evaluate: Evaluator = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        translator = Translator(self.text)
        object.__setattr__(self, "_evaluate", translator.number())
        object.__setattr__(self, "variables", frozenset(translator.used))
        object.__setattr__(self, "is_smooth", not translator.chooses)

    def __reduce__(self) -> tuple[Any, ...]:
        """Return the text for a pickle; the copy parses it again."""
        return Expression, (self.text, self.frame)

    @property
    def is_scaled(self) -> bool:
        """Return whether X, Y or Z occurs in the formula."""
        return not self.variables.isdisjoint(SCALED)

    @property
    def scaled_text(self) -> str | None:
        """Return the formula with X, Y, Z in place of x, y, z; None where x, y, z do not occur."""
        if self.variables.isdisjoint(COORDINATES):
            return None
        return re.sub(r"\b[xyz]\b", lambda match: match.group().upper(), self.text)

    def placed(self, frame: UnitFrame) -> "Expression":
        """Return the same formula with X, Y, Z measured in a frame."""
        return replace(self, frame=frame)

    def __call__(self, x: ArrayLike, y: ArrayLike, z: ArrayLike) -> Array:
        """Return values at points given by arrays of equal shape."""
        points = np.broadcast_arrays(*(np.asarray(c, dtype=np.float64) for c in (x, y, z)))
        return np.broadcast_to(np.asarray(self.jet([Jet(point, (), ()) for point in points]).value), points[0].shape)

    def jet(self, x: Sequence[Jet]) -> Jet:
        """Return the formula's jet from those of x, y and z.

        Raises ExpressionError where X, Y, Z occur without a frame.
        """
        variables = list(x)
        if self.is_scaled:
            if self.frame is None:
                raise ExpressionError(
                    f"{_shorten(self.text)!r}: X, Y, Z are scaled by the size of a volume: name it with "
                    "problem.on(volume)"
                )
            variables += scaled(self.frame, x)
        with np.errstate(all="ignore"):
            return self._evaluate(variables)


def scaled(frame: UnitFrame, x: Sequence[Jet]) -> list[Jet]:
    """Return the jets of X, Y, Z from those of x, y, z."""
    return [(1.0 / frame.length) * (c - middle) for c, middle in zip(x, frame.center, strict=True)]


def _shorten(text: str, length: int = 40) -> str:
    return text if len(text) <= length else text[: length - 3] + "..."


class Translator:
    """Translate a text into nested closures, and refuse every construct that is not on the list.

    variables: the names of numbers. marks: the names of conditions. near: the tolerance with which a condition compares
    two numbers; without it they are compared to the last bit. used: the names that occur. chooses: whether where, min
    or max occurs. Raises ExpressionError, here and in `number` and `condition`, for a refused construct.
    """

    def __init__(
        self,
        text: str,
        variables: Sequence[str] = VARIABLES,
        marks: Sequence[str] = (),
        near: Tolerance = lambda a, b: 0.0,
    ) -> None:
        if not isinstance(text, str):
            raise ExpressionError(f"an expression must be text, got {type(text).__name__}")
        self.text, self.variables, self.marks, self.near = text.strip(), variables, marks, near
        self.used: set[str] = set()
        self.chooses = False
        if not self.text:
            raise ExpressionError("the expression is empty; write a formula such as exp(X+Z)*sin(Y)")
        if len(self.text) > MAX_LENGTH:
            raise ExpressionError(f"the expression has {len(self.text)} characters; at most {MAX_LENGTH} are allowed")
        depth = 0
        for column, character in enumerate(self.text, 1):  # before Python's parser sees the text
            depth += (character == "(") - (character == ")")
            if depth > MAX_DEPTH:
                raise ExpressionError(f"expression, column {column}: more than {MAX_DEPTH} nested parentheses")
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # Python's, on texts that are refused below
                tree = ast.parse(self.text, mode="eval")
        except SyntaxError as error:
            place = f", column {error.offset}" if error.offset else ""
            hint = "; a product is written with *, as in 2*x" if "decimal literal" in error.msg else ""
            raise ExpressionError(f"expression{place}, {_shorten(self.text)!r}: {error.msg}{hint}") from None
        except (ValueError, MemoryError, RecursionError) as error:
            raise ExpressionError(f"expression, {_shorten(self.text)!r}: cannot be parsed ({error})") from None
        self.body = tree.body

    def number(self) -> Evaluator:
        """Return the text as a function of the values that gives one number a point."""
        return self._node(self.body, 1)

    def condition(self) -> Decider:
        """Return the text as a function of the values that gives the mask of the points where the condition holds."""
        return self._condition(self.body, 1)

    def _refuse(self, node: ast.expr, why: str) -> ExpressionError:
        place = _shorten(ast.get_source_segment(self.text, node) or "")
        return ExpressionError(f"expression, column {node.col_offset + 1}, {place!r}: {why}")

    def _node(self, node: ast.expr, depth: int) -> Evaluator:
        if depth > MAX_DEPTH:
            raise self._refuse(node, f"nested more than {MAX_DEPTH} deep")
        match node:
            case ast.Constant(value=value):
                return self._number(node, value)
            case ast.Name(id=name) if name in CONSTANTS:
                return _constant(CONSTANTS[name])
            case ast.Name(id=name) if name in self.variables:
                self.used.add(name)
                return operator.itemgetter(self.variables.index(name))
            case ast.Name(id=name) if name in self.marks:
                raise self._refuse(node, "is a condition, where a number must stand")
            case ast.Name():
                raise self._unknown(node)
            case ast.Compare() | ast.BoolOp() | ast.UnaryOp(op=ast.Not()):
                raise self._refuse(node, "is a condition, where a number must stand: write where(condition, a, b)")
            case ast.UnaryOp(op=ast.USub()):
                inner = self._node(node.operand, depth + 1)
                return lambda p: -inner(p)
            case ast.UnaryOp(op=ast.UAdd()):
                return self._node(node.operand, depth + 1)
            case ast.BinOp(op=ast.BitXor()):
                raise self._refuse(node, "a power is written with **, as in x**2")
            case ast.BinOp(op=op) if type(op) in OPERATORS:
                return self._binary(node, depth)
            case ast.Call():
                return self._call(node, depth)
        raise self._refuse(node, f"not allowed; use numbers, x y z X Y Z pi e, + - * / ** and {' '.join(FUNCTIONS)}")

    def _unknown(self, node: ast.expr) -> ExpressionError:
        names = ", ".join((*self.variables, *CONSTANTS, *FUNCTIONS, *CHOICES, *self.marks))
        return self._refuse(node, f"unknown name; the names are {names}")

    def _condition(self, node: ast.expr, depth: int) -> Decider:
        if depth > MAX_DEPTH:
            raise self._refuse(node, f"nested more than {MAX_DEPTH} deep")
        match node:
            case ast.Name(id=name) if name in self.marks:
                self.used.add(name)
                return operator.itemgetter(len(self.variables) + self.marks.index(name))
            case ast.Name(id=name) if name not in self.variables:
                raise self._unknown(node)
            case ast.UnaryOp(op=ast.Not()):
                inner = self._condition(node.operand, depth + 1)
                return lambda p: ~inner(p)
            case ast.BoolOp(op=op):
                parts = [self._condition(part, depth + 1) for part in node.values]
                join = np.logical_and if isinstance(op, ast.And) else np.logical_or
                return lambda p: functools.reduce(join, [part(p) for part in parts])
            case ast.Compare(ops=ops) if all(type(op) in COMPARISONS for op in ops):
                sides = [self._node(side, depth + 1) for side in (node.left, *node.comparators)]
                tests = [COMPARISONS[type(op)] for op in ops]
                return lambda p: self._all_hold(tests, [side(p) for side in sides])
            case ast.Compare():
                raise self._refuse(node, "conditions compare with <, <=, > and >=: surfaces are not met exactly")
        raise self._refuse(node, "is a number, where a condition must stand, such as z < 1 or nx > 0.9")

    def _all_hold(self, tests: Sequence[Comparison], sides: Sequence[Jet]) -> Any:
        """Return whether each number and the next satisfy the comparison between them, as in 0 < x < 1."""
        pairs = zip(tests, pairwise(sides), strict=True)
        return functools.reduce(np.logical_and, [test(a.value, b.value, self.near(a, b)) for test, (a, b) in pairs])

    def _number(self, node: ast.Constant, value: Any) -> Evaluator:
        if type(value) not in (int, float):
            raise self._refuse(node, "only real numbers are allowed")
        if not abs(value) <= sys.float_info.max:
            raise self._refuse(node, "the number is too large")
        return _constant(float(value))

    def _call(self, node: ast.Call, depth: int) -> Evaluator:
        name = node.func.id if isinstance(node.func, ast.Name) else ""
        if name in CHOICES:
            return self._choice(node, name, depth)
        if name not in FUNCTIONS:
            meant, names = name.lower(), (*FUNCTIONS, *CHOICES)
            remedy = f"write {meant}" if meant in names else f"the functions are {', '.join(names)}"
            raise self._refuse(node.func, f"not a known function; {remedy}")
        if len(node.args) != 1 or node.keywords:
            raise self._refuse(node, f"{name} takes exactly one argument")
        function, inner = FUNCTIONS[name], self._node(node.args[0], depth + 1)
        return lambda p: function(inner(p))

    def _choice(self, node: ast.Call, name: str, depth: int) -> Evaluator:
        if len(node.args) != CHOICES[name] or node.keywords:
            raise self._refuse(node, f"{name} takes exactly {CHOICES[name]} arguments")
        self.chooses = True
        first, second = (self._node(part, depth + 1) for part in node.args[-2:])
        if name == "where":
            decide = self._condition(node.args[0], depth + 1)
            return lambda p: _chosen(decide(p), first(p), second(p))
        better = operator.le if name == "min" else operator.ge

        def best(p: Values) -> Jet:
            a, b = first(p), second(p)
            return _chosen(better(a.value, b.value), a, b)

        return best

    def _binary(self, node: ast.BinOp, depth: int) -> Evaluator:
        left, right = self._node(node.left, depth + 1), self._node(node.right, depth + 1)
        names = {part.id for part in ast.walk(node.right) if isinstance(part, ast.Name)}
        if isinstance(node.op, ast.Pow) and names.isdisjoint((*self.variables, *self.marks)):
            with np.errstate(all="ignore"):
                exponent = float(right([]).value)
            if not abs(exponent) <= MAX_EXPONENT:
                raise self._refuse(node.right, f"the exponent must lie between -{MAX_EXPONENT} and {MAX_EXPONENT}")
            return lambda p: left(p).power(exponent)
        combine = OPERATORS[type(node.op)]
        return lambda p: combine(left(p), right(p))


def _chosen(condition: Any, a: Jet, b: Jet) -> Jet:
    """Return a jet with the values of `a` where a condition holds, and of `b` elsewhere."""

    def entry(one: Any, other: Any) -> Any:
        return np.where(condition, one, other)

    gradient = tuple(map(entry, a.gradient, b.gradient))
    return Jet(entry(a.value, b.value), gradient, tuple(map(entry, a.hessian, b.hessian)))


def _constant(number: float) -> Evaluator:
    jet = Jet(np.float64(number))  # unlike a Python float it overflows to inf and never turns complex
    return lambda p: jet
