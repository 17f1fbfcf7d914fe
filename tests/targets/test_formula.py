"""Formulas, jets and height fields against derivatives written by hand, and every way of getting them wrong."""

import pickle
import subprocess
import sys
from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from rodshell.errors import InputError
from rodshell.targets import Cap, Disc, HeightField, Paraboloid, Rectangle
from rodshell.targets.height_function import Heights
from rodshell.targets.heightfield import parse_formula
from rodshell.targets.jet import Jet, differences
from rodshell.targets.rim import EllipseDomain

Floats = NDArray[np.float64]
DISC = Disc(0.2)
PARTS = ("value", "dx", "dy", "dxx", "dxy", "dyy")


def jet_of(function, x: Floats, y: Floats) -> dict[str, Floats]:
    jet = function(*Jet.variables(x, y))
    return {part: np.broadcast_to(getattr(jet, part), x.shape) for part in PARTS}


def assert_jets_equal(found: dict[str, Floats], expected: dict[str, Floats], rtol: float = 1e-12) -> None:
    for part in PARTS:
        scale = np.abs(expected[part]).max() + 1e-300
        np.testing.assert_allclose(found[part], expected[part], rtol=rtol, atol=rtol * scale, err_msg=part)


def points(count: int = 50, low: float = 0.1, high: float = 0.9) -> tuple[Floats, Floats]:
    x, y = np.random.default_rng(0).uniform(low, high, (2, count))
    return x, y


# derivatives ----------------------------------------------------------------------------------------------

BY_HAND = {
    "x": (lambda x, y: (x, 1, 0, 0, 0, 0)),
    "y": (lambda x, y: (y, 0, 1, 0, 0, 0)),
    "0.3": (lambda x, y: (0.3, 0, 0, 0, 0, 0)),
    "x*y": (lambda x, y: (x * y, y, x, 0, 1, 0)),
    "1 - 2*x^2 - y^2": (lambda x, y: (1 - 2 * x * x - y * y, -4 * x, -2 * y, -4, 0, -2)),
    "x/y": (lambda x, y: (x / y, 1 / y, -x / y**2, 0, -1 / y**2, 2 * x / y**3)),
    "1/(x*y)": (
        lambda x, y: (
            1 / (x * y),
            -1 / (x**2 * y),
            -1 / (x * y**2),
            2 / (x**3 * y),
            1 / (x * y) ** 2,
            2 / (x * y**3),
        )
    ),
    "x^3*y^4": (
        lambda x, y: (
            x**3 * y**4,
            3 * x**2 * y**4,
            4 * x**3 * y**3,
            6 * x * y**4,
            12 * x**2 * y**3,
            12 * x**3 * y**2,
        )
    ),
    "x^-1.5": (lambda x, y: (x**-1.5, -1.5 * x**-2.5, 0, 3.75 * x**-3.5, 0, 0)),
    "x^y": (
        lambda x, y: (
            x**y,
            y * x ** (y - 1),
            x**y * np.log(x),
            y * (y - 1) * x ** (y - 2),
            x ** (y - 1) * (1 + y * np.log(x)),
            x**y * np.log(x) ** 2,
        )
    ),
    "2^x": (lambda x, y: (2**x, 2**x * np.log(2), 0, 2**x * np.log(2) ** 2, 0, 0)),
    "exp(x*y)": (
        lambda x, y: tuple(np.exp(x * y) * part for part in (1, y, x, y * y, 1 + x * y, x * x))  #
    ),
    "log(x + 2*y)": (
        lambda x, y: (
            np.log(x + 2 * y),
            1 / (x + 2 * y),
            2 / (x + 2 * y),
            -1 / (x + 2 * y) ** 2,
            -2 / (x + 2 * y) ** 2,
            -4 / (x + 2 * y) ** 2,
        )
    ),
    "sqrt(x^2 + y^2)": (
        lambda x, y: (
            np.hypot(x, y),
            x / np.hypot(x, y),
            y / np.hypot(x, y),
            y**2 / np.hypot(x, y) ** 3,
            -x * y / np.hypot(x, y) ** 3,
            x**2 / np.hypot(x, y) ** 3,
        )
    ),
    "sin(x)*cos(y)": (
        lambda x, y: (
            np.sin(x) * np.cos(y),
            np.cos(x) * np.cos(y),
            -np.sin(x) * np.sin(y),
            -np.sin(x) * np.cos(y),
            -np.cos(x) * np.sin(y),
            -np.sin(x) * np.cos(y),
        )
    ),
    "tan(x)": (lambda x, y: (np.tan(x), np.cos(x) ** -2, 0, 2 * np.sin(x) / np.cos(x) ** 3, 0, 0)),
    "asin(y)": (lambda x, y: (np.arcsin(y), 0, (1 - y * y) ** -0.5, 0, 0, y * (1 - y * y) ** -1.5)),
    "acos(y)": (lambda x, y: (np.arccos(y), 0, -((1 - y * y) ** -0.5), 0, 0, -y * (1 - y * y) ** -1.5)),
    "atan(x)": (lambda x, y: (np.arctan(x), 1 / (1 + x * x), 0, -2 * x / (1 + x * x) ** 2, 0, 0)),
    "sinh(x)": (lambda x, y: (np.sinh(x), np.cosh(x), 0, np.sinh(x), 0, 0)),
    "cosh(x)": (lambda x, y: (np.cosh(x), np.sinh(x), 0, np.cosh(x), 0, 0)),
    "tanh(x)": (lambda x, y: (np.tanh(x), np.cosh(x) ** -2, 0, -2 * np.tanh(x) / np.cosh(x) ** 2, 0, 0)),
    "abs(x - y)": (lambda x, y: (np.abs(x - y), np.sign(x - y), -np.sign(x - y), 0, 0, 0)),
    "abs(x - .5)^3": (
        lambda x, y: (np.abs(x - 0.5) ** 3, 3 * (x - 0.5) * np.abs(x - 0.5), 0, 6 * np.abs(x - 0.5), 0, 0)
    ),
    "sin(pi*x)": (
        lambda x, y: (np.sin(pi * x), pi * np.cos(pi * x), 0, -(pi**2) * np.sin(pi * x), 0, 0)  #
    ),
}


@pytest.mark.parametrize("text", BY_HAND)
def test_derivatives_are_those_written_by_hand(text):
    x, y = points()
    expected = {part: np.broadcast_to(value, x.shape) for part, value in zip(PARTS, BY_HAND[text](x, y), strict=True)}
    assert_jets_equal(jet_of(parse_formula(text), x, y), expected)
    np.testing.assert_allclose(parse_formula(text)(x, y), expected["value"], rtol=1e-15)


NUMPY_FUNCTIONS = {
    "sqrt": np.sqrt,
    "square": np.square,
    "reciprocal": np.reciprocal,
    "exp": np.exp,
    "exp2": np.exp2,
    "expm1": np.expm1,
    "log": np.log,
    "log2": np.log2,
    "log10": np.log10,
    "log1p": np.log1p,
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "arcsin": np.arcsin,
    "arccos": np.arccos,
    "arctan": np.arctan,
    "sinh": np.sinh,
    "cosh": np.cosh,
    "tanh": np.tanh,
    "negative": np.negative,
    "positive": np.positive,
    "absolute": np.absolute,
    "fabs": np.fabs,
}


@pytest.mark.parametrize("name", NUMPY_FUNCTIONS)
def test_numpy_functions_of_jets_agree_with_differences(name):
    x, y = points(low=0.2, high=0.8)

    def function(x, y):
        return NUMPY_FUNCTIONS[name](0.3 * x + 0.5 * x * y + 0.1)

    measured, found = differences(function, x, y, 2e-3), jet_of(function, x, y)
    for part in PARTS:  # fourth order, 1e-11 of the sixth derivative, and round-off of 1e-16 / step^2
        np.testing.assert_allclose(found[part], getattr(measured, part), rtol=1e-6, atol=1e-9, err_msg=part)


def test_numpy_functions_of_two_jets_or_of_a_jet_and_an_array():
    x, y = points()
    c = np.linspace(1, 2, len(x))
    assert_jets_equal(jet_of(np.hypot, x, y), jet_of(parse_formula("sqrt(x^2+y^2)"), x, y))
    for left, right in (
        (lambda x, y: c * x, lambda x, y: x * c),
        (lambda x, y: c - x * y, lambda x, y: -(x * y - c)),
        (lambda x, y: c / x, lambda x, y: c * x**-1),
        (lambda x, y: x / c, lambda x, y: x * (1 / c)),
        (lambda x, y: np.float64(2) * x + np.int64(3), lambda x, y: 3 + x * 2),
        (lambda x, y: np.power(x, 2), lambda x, y: x * x),
        (lambda x, y: x**c, lambda x, y: np.exp(c * np.log(x))),
        (lambda x, y: c**x, lambda x, y: np.exp(x * np.log(c))),
        (lambda x, y: np.add(np.subtract(x, y), np.divide(x, y)), lambda x, y: x - y + x / y),
        (lambda x, y: abs(-x) + (+y), lambda x, y: x + y),
        (lambda x, y: x**0 + y**1, lambda x, y: y + 1),
    ):
        assert_jets_equal(jet_of(left, x, y), jet_of(right, x, y))


def test_jets_of_jets_hold_higher_derivatives():
    x, y = points()
    inner_x, inner_y = Jet.variables(x, y)
    f = np.exp(Jet(inner_x, dx=1.0) * Jet(inner_y, dy=1.0))  # exp(x y)
    np.testing.assert_allclose(f.dxx.dyy, (2 + 4 * x * y + x * x * y * y) * np.exp(x * y), rtol=1e-12)
    np.testing.assert_allclose(f.dxy.dxy, (1 + 3 * x * y + x * x * y * y + x * y + 1) * np.exp(x * y), rtol=1e-12)


@pytest.mark.parametrize(
    "refused",
    [
        lambda x: x > 0,
        lambda x: x == 0,
        lambda x: x != 0,
        bool,
        float,
        int,
        len,
        list,
        np.asarray,
        lambda x: np.where(np.ones(3, dtype=bool), x, 0.0),
        lambda x: np.maximum(x, 0.0),
        lambda x: np.floor(x),
        lambda x: np.add(x, 1.0, out=np.zeros(3)),
        lambda x: np.add.reduce(x),
        lambda x: np.zeros_like(x),
        lambda x: x[0],
        hash,
    ],
)
def test_jets_refuse_what_has_no_derivative(refused):
    with pytest.raises(TypeError):
        refused(Jet.variables(np.ones(3), np.ones(3))[0])


leaves = st.sampled_from(["x", "y", "2", "3", "0.5", "1.25", "pi"])
formulas = st.recursive(
    leaves,
    lambda inner: st.one_of(
        st.builds("({} {} {})".format, inner, st.sampled_from("+-*"), inner),
        st.builds("({})/(3 + sin({}))".format, inner, inner),
        st.builds("{}({})".format, st.sampled_from(["sin", "cos", "tanh", "atan"]), inner),
        st.builds("sqrt(1 + ({})^2)".format, inner),
        st.builds("(-{})^{}".format, inner, st.sampled_from(["2", "3"])),
    ),
    max_leaves=12,
)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(formulas)
def test_any_formula_equals_python_and_its_derivatives_the_differences(text):
    x, y = points(7, 0.2, 0.6)
    f = parse_formula(text)
    names = {"x": x, "y": y, "pi": pi, "sin": np.sin, "cos": np.cos, "tanh": np.tanh, "sqrt": np.sqrt}
    plain = eval(text.replace("^", "**"), names | {"atan": np.arctan})
    np.testing.assert_allclose(f(x, y), plain + 0 * x, rtol=1e-13, atol=1e-13)
    found = jet_of(f, x, y)
    step = 1e-3
    for part, along, other in (("dx", step, 0), ("dy", 0, step)):
        ahead, behind = jet_of(f, x + along, y + other), jet_of(f, x - along, y - other)
        curved = found["dxx"] if part == "dx" else found["dyy"]
        scale = 1 + np.abs(ahead["dx"]) + np.abs(ahead["dy"]) + np.abs(curved) + np.abs(found["value"])
        # second order: 1e-6 of the third derivative, which scales like a power of the others
        for slope, value in ((found[part], "value"), (curved, part), (found["dxy"], "dy" if part == "dx" else "dx")):
            error = np.abs((ahead[value] - behind[value]) / (2 * step) - slope)
            assert np.all(error < 1e-4 * scale**3), (part, value)


# reading --------------------------------------------------------------------------------------------------


def test_python_precedence_holds():
    for text, value in {
        "-2^2*x": -4.0,
        "2^3^2*x": 512.0,
        "2^-1*x": 0.5,
        "8/4/2*x": 1.0,
        "1 - 2 - 3*x": -4.0,
        "+x": 1.0,
        "--x": 1.0,
        "2*-x": -2.0,
        "1e-3*x": 1e-3,
        ".5*x": 0.5,
        "x\n + 1": 2.0,
        "e*x/exp(1)": 1.0,
        "2 + 2*(x*x)*x": 4.0,
        "(x*y + 1)*2 + 2*x": 6.0,
    }.items():
        assert parse_formula(text)(np.ones(2), np.ones(2)) == pytest.approx([value, value]), text


def test_every_part_of_a_formula_is_evaluated_once():
    bumps = "exp(-((x-1)^2 + y^2)/2) + exp(-((x+1)^2 + y^2)/2)"
    # x-1, ^2, y^2, +, -, /2, exp; x+1, ^2, +, -, /2, exp; +
    assert len(parse_formula(bumps).steps) == 14


REFUSED = {
    "": "empty",
    " \n ": "empty",
    "z": '"z" is not allowed',
    "X": "did you mean x?",
    "a*x": '"a"',
    "sen(x)": "did you mean sin?",
    "arctan(x)": "did you mean atan?",
    "ln(x)": "did you mean log?",
    "np.exp(x)": '"np.exp(x)" is not allowed (did you mean exp?)',
    "x.real": '"x.real"',
    "x.__class__": "is not allowed",
    "__import__('os')": "is not allowed",
    "(lambda: x)()": '":"',
    "exp": '"exp" has no value: write exp(...)',
    "exp()": '"exp()" has 0 values',
    "exp(x, y)": '"exp(x, y)" has 2 values',
    "exp(*x)": '"*x"',
    "exp(x=1)": '"="',
    "exp(x)(y)": '"exp(x)(y)"',
    "max(x, y)": '"max(x, y)"',
    "'x'": "is not allowed",
    '"x"': "is not allowed",
    "f'{x}'": "is not allowed",
    "x < y": '"<"',
    "x == y": '"="',
    "z = x": "only the part after it",
    "x if y else 1": '"x if y else 1"',
    "x and y": '"x and y"',
    "not x": '"not x"',
    "~x": '"~"',
    "x % y": '"%"',
    "x // y": '"//"',
    "x @ y": '"@"',
    "[x]": '"["',
    "{x}": '"{"',
    "x, y": '"x, y"',
    "x; y": '";"',
    "x # y": '"#"',
    "x := 1": '":"',
    "True": '"True"',
    "None": '"None"',
    "1j*x": '"1j"',
    "...": '"..."',
    "x²": "did you mean ^2?",
    "x − y": "did you mean -?",
    "ｘ": '"ｘ"',
    "x\x00": "is not allowed",
    "2x": 'from "2x" on',
    "x^2 + 3 x": 'from "x" on',
    "(x": 'from "(x" on',
    "x) + (y": 'from ") + (y" on',
    "x +": "cannot be read",
    "1.2.3": "cannot be read",
    "1/0": '"1/0" divides by zero',
    "x/(2-2)": '"x/(2-2)" divides by zero',
    "10**10**10": '"10**10**10" is not a finite number',
    "10^10^10*x": '"10^10^10" is not a finite number',
    "1e999": '"1e999" is not a finite number',
    "9" * 400: "is not a finite number",
    "9" * 3999: "formula",
    "sqrt(-1)": '"sqrt(-1)" is not a finite number',
    "(-8)^(1/3)": "is not a finite number",
    "exp(1000)": "is not a finite number",
    "x*" * 3000 + "x": "6001 characters",
    "(" * 150 + "x" + ")" * 150: "100 nested parentheses",
    "-" * 3900 + "x": "nested too deeply",
}


@pytest.mark.parametrize("text", REFUSED, ids=lambda text: repr(text[:20]))
def test_what_is_no_formula_is_refused_in_one_sentence(text):
    with pytest.raises(InputError) as refusal:
        parse_formula(text)
    message = str(refusal.value)
    assert REFUSED[text] in message
    assert "\n" not in message
    assert len(message) < 500
    if "is not allowed" in message or "cannot be read" in message:
        assert "sqrt, exp, log" in message


@pytest.mark.parametrize("text", [None, 3, b"x", ["x"]])
def test_a_formula_must_be_text(text):
    with pytest.raises(InputError, match="must be text"):
        parse_formula(text)


@settings(max_examples=300, deadline=None, derandomize=True)
@given(st.text(alphabet="xyepi0123456789.+-*/^() sqrtanlogc,_=<'[\n", max_size=60))
def test_any_text_is_a_formula_or_an_input_error(text):
    try:
        f = parse_formula(text)
    except InputError:
        return
    with np.errstate(all="ignore"):
        assert np.shape(f(np.ones(3), np.ones(3))) == (3,)


def test_long_formulas_within_the_limits_are_read():
    for text in ("x" + "+x" * 1900, "x" + "^x" * 1900, "sin(" * 100 + "x" + ")" * 100):
        assert np.isfinite(parse_formula(text)(np.full(2, 0.9), np.zeros(2))).all()


def test_reading_neither_runs_code_nor_warns():
    """In a process of its own: the parser must survive whatever it is fed."""
    script = (
        "import builtins, warnings; warnings.simplefilter('error')\n"
        "from rodshell.targets.heightfield import parse_formula\n"
        "from rodshell.errors import InputError\n"
        "def forbidden(*_): raise SystemExit('code was run')\n"
        "builtins.eval = builtins.exec = forbidden\n"
        "long = ('-'*4000, '('*4000, '(x)'*1000, '**'.join('x'*1300), 'x('*1000, '+x'*1999, 'not '*900)\n"
        "for text in (*long, '1if x', '1or x', '0x1for x', 'x(1)'):\n"
        "    try: parse_formula(text)\n"
        "    except InputError: pass\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_formulas_pickle_as_their_text():
    f = parse_formula("0.1 - x^2*exp(y)")
    again = pickle.loads(pickle.dumps(f))
    assert again == f
    assert again(0.3, 0.2) == f(0.3, 0.2)


# height fields --------------------------------------------------------------------------------------------


def implicit_parts(field: HeightField, x: Floats) -> Floats:
    value, gradient, hessian = field.implicit(x)
    return np.column_stack([value, gradient, hessian.reshape(-1, 9)])


def sample_points(size: float = 0.3) -> Floats:
    return np.random.default_rng(1).uniform(-size, size, (200, 3))


def test_a_function_equals_its_formula():
    formula = HeightField(formula="0.1*exp(-(x/0.1)^2/2)*cos(5*y) + x^3/(2 + y)", domain=DISC)
    function = HeightField(
        function=lambda x, y: 0.1 * np.exp(-((x / 0.1) ** 2) / 2) * np.cos(5 * y) + x**3 / (2 + y), domain=DISC
    )
    x = sample_points()
    np.testing.assert_allclose(implicit_parts(function, x), implicit_parts(formula, x), rtol=1e-13, atol=1e-15)
    assert function.summit == pytest.approx(formula.summit, abs=1e-12)


def test_a_function_that_refuses_jets_gets_differences():
    def stiff(x, y):
        return np.where(np.isfinite(x), 0.1 * np.exp(-((x / 0.1) ** 2) / 2) * np.cos(5 * y), 0.0)

    exact = HeightField(formula="0.1*exp(-(x/0.1)^2/2)*cos(5*y)", domain=DISC)
    field = HeightField(function=stiff, domain=DISC)
    x = sample_points()
    found, expected = field.implicit(x), exact.implicit(x)
    np.testing.assert_array_equal(found.value, expected.value)
    # fourth order at 0.4 mm: (h/0.1)^4 f / 30 / h; measured 2e-9 and 2e-7
    np.testing.assert_allclose(found.gradient, expected.gradient, atol=1e-8)
    np.testing.assert_allclose(found.hessian, expected.hessian, atol=1e-6)


def test_differences_are_exact_for_polynomials_of_fourth_degree():
    x, y = points()
    f = parse_formula("1 + x - 2*y + 3*x^2 - x*y + y^2 + x^3 - 2*x^2*y + x*y^2 + x^4 - x^3*y + x^2*y^2 + y^4")
    measured = differences(f, x, y, 0.1)
    assert_jets_equal({part: getattr(measured, part) for part in PARTS}, jet_of(f, x, y), rtol=1e-11)


@pytest.mark.parametrize("flat", [lambda x, y: 0.1, lambda x, y: 0.1 + 0 * x, lambda x, y: np.float64(0.1), None])
def test_a_constant_height_is_a_plane(flat):
    field = HeightField(function=flat, domain=DISC) if flat else HeightField(formula="0.1", domain=DISC)
    x = sample_points()
    value, gradient, hessian = field.implicit(x)
    np.testing.assert_allclose(value, x[:, 2] - 0.1, atol=1e-16)
    np.testing.assert_allclose(gradient, np.tile([0, 0, 1.0], (200, 1)), atol=1e-12)
    np.testing.assert_allclose(hessian, 0.0, atol=1e-8)
    np.testing.assert_allclose(field.height_at(x[:, :2]), 0.1)
    assert field.summit == (0.0, 0.0)


def test_a_field_equals_the_quadric_that_it_describes():
    bowl = HeightField(formula="0.12*(1 - (x^2 + y^2)/0.2^2)", domain=DISC)
    quadric = Paraboloid(0.2, 0.12)
    x = sample_points()
    np.testing.assert_allclose(bowl.implicit(x).value, quadric.implicit(x).value, atol=1e-15)
    np.testing.assert_allclose(bowl.implicit(x).gradient, quadric.implicit(x).gradient, atol=1e-15)
    np.testing.assert_allclose(bowl.implicit(x).hessian, quadric.implicit(x).hessian, atol=1e-14)
    cap, formula = Cap(0.25, 0.15), HeightField(formula="sqrt(0.25^2 - x^2 - y^2)", domain=DISC)
    x = cap.retract(sample_points(0.1) + [0, 0, 0.25])
    found, expected = formula.on_surface(x), cap.on_surface(x)
    np.testing.assert_allclose(found.normal, expected.normal, atol=1e-13)
    np.testing.assert_allclose(found.hessian, expected.hessian, atol=1e-11)


def test_implicit_may_be_called_with_no_and_with_one_point():
    for formula in ("0.1 - x^2", "sqrt(0.21^2 - x^2 - y^2)"):
        field = HeightField(formula=formula, domain=DISC)
        for count in (0, 1):
            value, gradient, hessian = field.implicit(np.full((count, 3), 0.3))
            assert (value.shape, gradient.shape, hessian.shape) == ((count,), (count, 3), (count, 3, 3))


def test_a_function_cannot_write_into_the_points():
    def rude(x, y):
        x *= 2
        return 0.1 - x * x

    def rude_and_plain(x, y):
        x *= 2
        return np.where(x < 9, 0.1 - x * x, 0.0)

    for function in (rude, rude_and_plain):
        field = HeightField(function=function, domain=DISC)
        assert field._heights.exact == (function is rude)
        x = sample_points()
        kept = x.copy()
        assert field.implicit(x).value == pytest.approx(x[:, 2] - 0.1 + 4 * x[:, 0] ** 2)
        field.height_at(x[:, :2])
        np.testing.assert_array_equal(x, kept)


def test_removable_singularities_are_filled():
    """sin(r)/r and cos(r) are smooth at r = 0, where sqrt and the quotient are not."""
    here = np.array([[0.0, 0.0, 0.0], [1e-9, 0.0, 0.0], [0.05, 0.02, 0.0]])
    r = np.hypot(here[:, 0], here[:, 1])
    cosine = HeightField(formula="0.1*cos(7*sqrt(x^2 + y^2))", domain=DISC)
    value, gradient, hessian = cosine.implicit(here)
    np.testing.assert_allclose(value, -0.1 * np.cos(7 * r), atol=1e-15)
    np.testing.assert_allclose(gradient[:2], [[0, 0, 1], [4.9e-9, 0, 1]], atol=1e-12)
    np.testing.assert_allclose(hessian[0], np.diag([4.9, 4.9, 0]), atol=1e-6)
    sinc = HeightField(formula="0.1*sin(9*sqrt(x^2 + y^2))/(9*sqrt(x^2 + y^2))", domain=DISC)
    value, gradient, hessian = sinc.implicit(here)
    np.testing.assert_allclose(value, -0.1 * np.sinc(9 * r / pi), atol=1e-15)
    np.testing.assert_allclose(gradient[0], [0, 0, 1], atol=1e-9)
    np.testing.assert_allclose(hessian[0], np.diag([2.7, 2.7, 0]), atol=1e-4)  # 0.1 9^2 / 3
    assert cosine.summit == sinc.summit == (0.0, 0.0)


BROKEN = {
    "sqrt(0.2^2 - x^2 - y^2)": ("infinite slope|no finite height", "0.2", "radius 0.19 m"),
    "sqrt(0.02 - x^2 - y^2)": ("no finite height", "0.14", "radius 0.14 m"),
    "log(x + 0.1)": ("no finite height|infinite slope", "-0.1", "smaller domain"),
    "1/x": ("infinite slope|no finite height", "(0, ", "another formula"),
    "1e-6/(x - 0.0513)": ("infinite slope", "(0.0513", "smaller domain"),  # between the samples
    "tan(10*x)": ("infinite slope", "0.1", "smaller domain"),
    "atan(1/(x - 0.05))": ("a step", "(0.05,", "smooth"),
    "0.2 - sqrt(x^2 + y^2)": ("a crease|a sharp point", "(0, 0)", "smooth"),
    "0.2 - 0.1*sqrt((x-.0314)^2 + (y+.0127)^2)": (
        "a sharp point",
        "(0.0314, -0.0127)",
        "smooth",
    ),  # between the samples
    "0.1 - abs(x - 0.031)": ("a crease", "(0.031,", "sqrt(u^2 + 0.01^2)"),
    "0.1 - abs(x)": ("a crease", "(0,", "smooth"),
    "sqrt(x^2)": ("a crease", "(0,", "smooth"),
    "0.01*tanh(x/1e-7)": ("infinite slope", "(0,", "another formula"),
    "x^y": ("no finite height", "(-0.00", "another formula"),
}


@pytest.mark.parametrize("formula", BROKEN)
def test_a_surface_that_is_not_smooth_is_refused_with_place_and_remedy(formula):
    with pytest.raises(InputError) as refusal:
        HeightField(formula=formula, domain=DISC)
    message = str(refusal.value)
    what, place, remedy = BROKEN[formula]
    assert any(kind in message for kind in what.split("|")), message
    assert place in message, message
    assert remedy in message, message
    assert "\n" not in message


def test_the_domain_that_is_proposed_will_do():
    formula = "sqrt(0.2^2 - x^2 - y^2)"
    with pytest.raises(InputError, match=r"radius 0\.19 m"):
        HeightField(formula=formula, domain=DISC)
    ball = HeightField(formula=formula, domain=Disc(0.19))
    assert ball.height_at(np.array([[0.12, 0.0], [0.0, 0.16]])) == pytest.approx([0.16, 0.12], abs=1e-15)
    with pytest.raises(InputError, match=r"size 0\.3\d m x 0\.2\d m"):
        HeightField(formula="sqrt(0.19^2 - x^2)", domain=Rectangle((0.4, 0.3)))


@pytest.mark.parametrize(
    "smooth",
    [
        "abs(x)^3",
        "sqrt(x^2 + 0.001^2)",
        "0.1*tanh(x/0.01)",
        "0.05*sin(60*x)*sin(50*y)",
        "0.3*exp(-(x^2 + y^2)/(2*.05^2))",
        "0.1 - x^4 - y^4",
        "(x + 0.2)^2.5",
    ],
)
def test_sharp_but_smooth_surfaces_are_taken_as_they_are(smooth):
    target = HeightField(formula=smooth, domain=DISC)
    xy = 0.2 * np.array([[0.0, 0.0], [0.5, -0.4], [-0.7, 0.3], [-0.999, 0.0]])
    names = {
        "x": xy[:, 0],
        "y": xy[:, 1],
        "exp": np.exp,
        "sqrt": np.sqrt,
        "tanh": np.tanh,
        "sin": np.sin,
        "abs": np.abs,
    }
    assert target.height_at(xy) == pytest.approx(
        eval(smooth.replace("^", "**"), names) + 0 * xy[:, 0], rel=1e-12, abs=1e-15
    )


def test_wrong_arguments_are_refused():
    with pytest.raises(InputError, match="exactly one"):
        HeightField(domain=DISC)
    with pytest.raises(InputError, match="exactly one"):
        HeightField(formula="x", function=lambda x, y: x, domain=DISC)
    with pytest.raises(InputError, match="use Disc"):
        HeightField(formula="x", domain=EllipseDomain(0.2, 0.1))
    with pytest.raises(InputError, match="must be positive"):
        HeightField(formula="x", domain=Disc(-1))


@pytest.mark.parametrize(
    "function",
    [
        lambda x, y: __import__("math").exp(x),
        lambda x, y: 1 / 0,
        lambda x, y: "high",
        lambda x, y: None,
        lambda x: x,
        lambda x, y: np.ones(3),
        lambda x, y: x + 1j,
        lambda x, y: 0.1 if x > 0 else 0.2,
    ],
)
def test_a_function_must_take_arrays(function):
    with pytest.raises(InputError, match="numpy functions"):
        HeightField(function=function, domain=DISC)


def test_a_function_that_ends_at_its_domain_must_be_continuable():
    with pytest.raises(InputError, match="numpy functions alone"):
        HeightField(function=lambda x, y: np.where(x**2 + y**2 < 0.05, 0.1 - x**2, np.nan), domain=DISC)


CONTINUED = {
    "disc": ("sqrt(0.25^2 - x^2 - y^2)*exp(x)", DISC),
    "rectangle": ("2*sqrt(.21^2 - x^2)*sqrt(.17^2 - y^2)*exp(x + y)", Rectangle((0.4, 0.3))),
    "disc up to the very edge": ("(x + 0.2)^4.5 + y", DISC),
    "steep": ("sqrt(0.2^2 - x^2 - y^2)", Disc(0.195)),
}


@pytest.mark.parametrize("name", CONTINUED)
def test_the_continuation_has_continuous_curvature(name):
    formula, domain = CONTINUED[name]
    heights = HeightField(formula=formula, domain=domain)._heights
    trusted = heights.trusted
    assert trusted is not None
    assert trusted.half_extent >= domain.half_extent
    a, b = trusted.half_extent
    angle = np.random.default_rng(2).uniform(0, 2 * pi, 200)
    edge = np.stack([a * np.cos(angle), b * np.sin(angle)])
    if isinstance(trusted, Rectangle):
        edge /= np.abs(edge / [[a], [b]]).max(axis=0)
    inside, outside = heights.jet(*(edge * (1 - 1e-9))), heights.jet(*(edge * (1 + 1e-9)))
    for part in PARTS:
        before, after = (np.broadcast_to(getattr(jet, part), 200) for jet in (inside, outside))
        np.testing.assert_allclose(after, before, rtol=1e-5, atol=1e-6, err_msg=part)
    for reach in (1.01, 1.3, 3.0, 20.0):
        assert all(np.isfinite(getattr(heights.jet(*(edge * reach)), part)).all() for part in PARTS)


def test_the_continuation_is_the_parabola_along_the_normal():
    heights = Heights(parse_formula("x^5 + x^2*y^3"), 0.2, trusted=DISC)
    for angle in (0.3, 2.0, -1.1):
        n = np.array([np.cos(angle), np.sin(angle)])
        t = 0.07
        jet = jet_of(parse_formula("x^5 + x^2*y^3"), *(0.2 * n)[:, None])
        along = jet["dx"] * n[0] + jet["dy"] * n[1]
        bent = jet["dxx"] * n[0] ** 2 + 2 * jet["dxy"] * n[0] * n[1] + jet["dyy"] * n[1] ** 2
        expected = jet["value"] + along * t + bent * t**2 / 2
        np.testing.assert_allclose(heights.jet(*((0.2 + t) * n)[:, None]).value, expected, rtol=1e-12)
    box = Heights(parse_formula("x^5 + x^2*y^3"), 0.2, trusted=Rectangle((0.4, 0.2)))
    dx, dy = 0.05, 0.03
    fifth = 0.2**5 + 5 * 0.2**4 * dx + 10 * 0.2**3 * dx**2
    third = 0.1**3 + 3 * 0.1**2 * dy + 3 * 0.1 * dy**2
    np.testing.assert_allclose(
        box.jet(np.array([0.2 + dx]), np.array([0.1 + dy])).value, fifth + (0.2 + dx) ** 2 * third, rtol=1e-12
    )


def test_a_formula_that_is_fine_outside_is_its_own_continuation():
    field = HeightField(formula="0.1*exp(-x^2) - y^2", domain=DISC)
    far = np.array([[0.5, -0.7], [0.1, 0.31]])
    np.testing.assert_allclose(field.height_at(far), 0.1 * np.exp(-(far[:, 0] ** 2)) - far[:, 1] ** 2)


SUMMITS = {
    "0.1 - (x-.03)^2 - (y+.05)^2": (0.03, -0.05),
    "0.1 - x^2 - y^2": (0, 0),
    "0.1 - x^4 - y^4": (0, 0),
    "0.1 - (x-.031)^4 - y^2": (0.031, 0),  # flat: known to 1e-5 m only
    "0.05*exp(-((x-.09)^2 + y^2)/.005) + 0.051*exp(-((x+.09)^2 + y^2)/.005)": (-0.09, 0),  # the higher of two
    "0.05*exp(-((x-.09)^2 + y^2)/.005) + 0.05*exp(-((x+.09)^2 + y^2)/.005)": (0, 0),  # tie
    "0.05*exp(-((x-.09)^2 + y^2)/.005) + 0.05000001*exp(-((x+.09)^2 + y^2)/.005)": (0, 0),  # nearly a tie
    "0.1*cos(30*sqrt(x^2 + y^2))": (0, 0),  # a peak and a ring as high
    "0.1 - x^2": (0, 0),  # a ridge
    "x": (0, 0),  # highest on the edge
    "(x^2 - y^2)/0.8": (0, 0),
    "0.03*exp(-((x-.05)^2 + y^2)/.002) - 2*x": (0, 0),  # a hill, and an edge above it
}


@pytest.mark.slow
@pytest.mark.parametrize("formula", SUMMITS)
@pytest.mark.parametrize("domain", [DISC, Rectangle((0.4, 0.36))], ids=["disc", "rectangle"])
def test_the_summit_is_the_one_highest_point_inside_or_the_centre(formula, domain):
    tolerance = 1e-5 if "^4" in formula else 1e-3 if "exp" in formula else 1e-12  # one bump shifts the other
    found = HeightField(formula=formula, domain=domain).summit
    assert found == pytest.approx(SUMMITS[formula], abs=tolerance)
    top = HeightField(formula=formula, domain=domain)
    if SUMMITS[formula] != (0, 0):
        slope = top.implicit(np.array([[*found, 0.0]])).gradient[0, :2]
        assert np.abs(slope).max() < 1e-12


def test_a_peak_just_outside_does_not_count():
    """A ring as high as the summit at (0.05, 0) passes the disc at a distance of 2 mm."""
    found = HeightField(formula="0.1*cos(24.9*sqrt((x-.05)^2 + y^2))", domain=DISC).summit
    assert found == pytest.approx((0.05, 0), abs=1e-5)  # the formula's 0/0 lies there


def test_parameters_are_those_of_a_case_file():
    disc = HeightField(formula="0.1 - x^2", domain=DISC)
    assert disc.parameters() == {"kind": "heightfield", "formula": "0.1 - x^2", "domain": "disc", "radius": 0.2}
    box = HeightField(function=saddle, domain=Rectangle((0.4, 0.3)), name="mine")
    assert box.parameters() == {
        "kind": "heightfield",
        "formula": None,
        "function": f"{__name__}.saddle",
        "domain": "rectangle",
        "size": [0.4, 0.3],
    }
    assert (disc.name, box.name) == ("heightfield", "mine")
    assert disc.base is None
    assert disc.plan == DISC


def saddle(x, y):
    return x * y


def test_height_fields_are_values():
    for field in (
        HeightField(formula="sqrt(0.21^2 - x^2 - y^2)", domain=DISC),
        HeightField(function=saddle, domain=Rectangle((0.4, 0.3))),
    ):
        _ = field.summit
        again = pickle.loads(pickle.dumps(field))
        assert again == field
        assert hash(again) == hash(field)
        x = sample_points()
        np.testing.assert_array_equal(implicit_parts(again, x), implicit_parts(field, x))
    assert HeightField(formula="x", domain=DISC) != HeightField(formula="y", domain=DISC)
