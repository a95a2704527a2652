import math

import formulas
import numpy as np
import pytest

from solve.forms.frame import UnitFrame
from solve.forms.jets import PAIRS
from solve.forms.parser import Expression, ExpressionError

POINTS = np.random.default_rng(0).uniform(0.3, 1.2, (3, 20))


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("2+3*4", 14.0),
        ("2**3**2", 512.0),
        ("-2**2", -4.0),
        ("(1-2)-3", -4.0),
        ("8/4/2", 1.0),
        ("cos(pi)", -1.0),
        ("log(e)", 1.0),
        ("abs(-3)*sqrt(16)", 12.0),
        ("1.5e1", 15.0),
        ("x + 10*y + 100*z", 321.0),
        ("+y", 2.0),
        ("+2**2", 4.0),
        ("-+y", -2.0),
        ("+-y", -2.0),
        ("x - +y", -1.0),
        ("x + + + y", 3.0),
        ("+(x)*+(y + +z)", 5.0),
        ("2*+y", 4.0),
        ("6/+y", 3.0),
        ("y**+3", 8.0),
        ("y**-+1", 0.5),
        ("abs(+x - +z)", 2.0),
        ("+Y", 20.0),
    ],
)
def test_values_by_hand(text, value):
    frame = UnitFrame((0.0, 0.0, 0.0), 0.1)  # Y = 10 y
    assert Expression(text, frame)(1.0, 2.0, 3.0) == pytest.approx(value)


@pytest.mark.parametrize(
    ("text", "gradient", "hessian"),
    [  # at (1, 2, 3)
        ("7", (0, 0, 0), (0, 0, 0, 0, 0, 0)),
        ("x*x*y", (4, 1, 0), (4, 2, 0, 0, 0, 0)),
        ("x**2 + y**2 + z**2", (2, 4, 6), (2, 0, 0, 2, 0, 2)),
        ("x*y*z", (6, 3, 2), (0, 3, 2, 0, 1, 0)),
        ("y/x", (-2, 1, 0), (4, -1, 0, 0, 0, 0)),
        ("log(y)", (0, 0.5, 0), (0, 0, 0, -0.25, 0, 0)),
        ("abs(0-x)", (1, 0, 0), (0, 0, 0, 0, 0, 0)),
        ("+x*+x*+y", (4, 1, 0), (4, 2, 0, 0, 0, 0)),
        ("-+(+y)**+2", (0, -4, 0), (0, 0, 0, -2, 0, 0)),
    ],
)
def test_derivatives_by_hand(text, gradient, hessian):
    _, found, second = formulas.hessian(Expression(text), 1.0, 2.0, 3.0)
    assert np.allclose(found, gradient, atol=1e-14)
    assert np.allclose(second, hessian, atol=1e-14)


@pytest.mark.parametrize(
    "text",
    [
        "exp(x+z)*sin(y)",
        "cos(x*y)/(1+z**2)",
        "tan(x*y*z/3)",
        "log(x+y)*sqrt(z+x)",
        "tanh(x-2*y+z**3)",
        "abs(x-5)*y**2",
        "x**y + 2**z + (x*y)**0.5 + x**-2",
        "x**1*y**0",
    ],
)
def test_derivatives_agree_with_differences(text):
    expression, step = Expression(text), 1e-5
    value, gradient, hessian = formulas.hessian(expression, *POINTS)
    assert np.allclose(value, expression(*POINTS), rtol=1e-15)
    assert np.array_equal(formulas.gradient(expression, *POINTS)[1], gradient)
    for a in range(3):
        offset = step * np.eye(3)[a][:, None]
        ahead, behind = (formulas.gradient(expression, *points) for points in (POINTS + offset, POINTS - offset))
        assert np.allclose(gradient[a], (ahead[0] - behind[0]) / (2 * step), rtol=1e-6, atol=1e-6)
        slopes = (ahead[1] - behind[1]) / (2 * step)  # (3, 20), of the gradient in direction a
        for pair, second in zip(PAIRS, hessian, strict=True):
            if a == pair[0]:
                assert np.allclose(second, slopes[pair[1]], rtol=1e-6, atol=1e-6)


def test_powers_are_differentiable_at_zero():
    _, gradient, hessian = formulas.hessian(Expression("x**2+y**1+z**0"), 0.0, 0.0, 0.0)
    assert np.allclose(gradient, (0, 1, 0))
    assert np.allclose(hessian, (2, 0, 0, 0, 0, 0))


def test_constants_take_the_shape_of_the_points():
    value, gradient, hessian = formulas.hessian(Expression("pi"), *np.zeros((3, 4, 5)))
    assert value.shape == (4, 5)
    assert gradient.shape == (3, 4, 5)
    assert hessian.shape == (6, 4, 5)
    assert np.all(value == math.pi)


ATTACKS = [
    "__import__('os').system('true')",
    "().__class__.__bases__",
    "x.real",
    "x[0]",
    "[x for x in y]",
    "lambda: 0",
    "x if y else z",
    "x and y",
    "x < y",
    "x // 2",
    "x % 2",
    "x @ y",
    "~x",
    "+",
    "+" * 900 + "x",
    "x +* y",
    "x := 1",
    "x; y",
    "'text'",
    "f'{x}'",
    "1j",
    "True",
    "None",
    "eval(x)",
    "sin",
    "sin()",
    "sin(x, y)",
    "sin(*x)",
    "sin(x=1)",
    "(sin)(x)(y)",
    "w",
    "x\0",
    "",
    "   ",
    "x +",
    "9**9**9",
    "x**65",
    "2**-65",
    "x**(1/0)",
    "x**((0-1)**0.5)",
    "1e999",
    "9" * 900,
    "(" * 10_000 + "x" + ")" * 10_000,
    "(" * 150 + "x" + ")" * 150,
    "-" * 900 + "x",
    "sin(" * 101 + "x" + ")" * 101,
    "x+" * 499 + "x",
    "x" * 5000,
]


@pytest.mark.parametrize("text", ATTACKS, ids=lambda text: text[:20].encode("unicode_escape").decode())
def test_everything_else_is_refused(text):
    with pytest.raises(ExpressionError):
        Expression(text)


def test_what_is_no_text_is_refused():
    with pytest.raises(ExpressionError, match="must be text"):
        Expression(3)


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("1 + foo*x", "column 5, 'foo'"),
        ("exp(x).real", "column 1, 'exp(x).real'"),
        ("x**99", "column 4, '99'"),
        ("sin(x)+sin(x,y)", "column 8, 'sin(x,y)'"),
        ("x + * y", "column 5"),
    ],
)
def test_errors_name_the_place(text, place):
    with pytest.raises(ExpressionError) as caught:
        Expression(text)
    assert place in str(caught.value)


def test_functions_in_capitals_are_named():
    with pytest.raises(ExpressionError, match="'Sin': not a known function; write sin"):
        Expression("2*Sin(x)")


def test_messages_stay_short_and_on_one_line():
    with pytest.raises(ExpressionError) as caught:
        Expression("+".join(["x"] * 400))
    assert len(str(caught.value)) < 200
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["exp(x+z)*3in(y)", "2or(x)", "x*6if(y)"])
def test_python_adds_no_warning_to_a_refusal(text, recwarn):
    with pytest.raises(ExpressionError):
        Expression(text)
    assert not recwarn.list
