"""Lie brackets by hand and by Jacobi's identity; LI and INV where the answer is known."""

import pytest
import sympy as sp

from mcmj.analysis import lie_brackets
from mcmj.utils.errors import InvalidArgumentError

X, Y, Z = sp.symbols("x y z")


def column(*entries):
    return sp.Matrix(entries)


def test_a_bracket_by_hand():
    """[f, g] = (dg/dx) f - (df/dx) g with f = (y, -x^2), g = (x, 1)."""
    bracket = lie_brackets.lie_bracket(column(Y, -(X**2)), column(X, 1), (X, Y))
    assert bracket == column(Y - 1, 2 * X**2)


def test_brackets_satisfy_jacobi():
    f, g, h = column(X * Y, Z**2, X), column(Y, X * Z, 1), column(Z, X**3, Y * Z)
    states = (X, Y, Z)

    def bracket(a, b):
        return lie_brackets.lie_bracket(a, b, states)

    total = bracket(f, bracket(g, h)) + bracket(g, bracket(h, f)) + bracket(h, bracket(f, g))
    assert sp.expand(total).is_zero_matrix
    assert not bracket(f, g).is_zero_matrix


def test_the_nonlinear_spring_is_linearisable():
    report = lie_brackets.check(lie_brackets.nonlinear_spring())
    m, d1, d3 = sp.symbols("m d1 d3", positive=True)
    assert report.linearisable
    assert report.fields[1] == column(-1 / m, (d1 + 3 * d3 * sp.Symbol("x2") ** 2) / m**2).expand()
    assert "feedback linearisable: yes" in str(report)


@pytest.mark.parametrize("masses", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_linear_arrays_have_the_determinant_of_appendix_e(masses):
    report = lie_brackets.check(lie_brackets.linear_array(masses))
    assert report.linearisable
    k = [sp.Symbol(f"k1_{i}", positive=True) for i in range(1, masses + 1)]
    d = [sp.Symbol(f"d1_{i}", positive=True) for i in range(1, masses + 1)]
    product = sp.Integer(1)
    for j in range(masses):
        for i in range(j):
            product *= (k[i] - k[j]) ** 2 + (d[i] - d[j]) * (d[i] * k[j] - d[j] * k[i])
    assert sp.expand(report.determinant**2 - product**2) == 0


def test_equal_springs_are_not():
    report = lie_brackets.check(lie_brackets.equal_array(2))
    assert (report.li, report.inv, report.rank) == (False, True, 2)
    one = dict.fromkeys(
        lie_brackets.linear_array(2).f.free_symbols - set(lie_brackets.linear_array(2).states), 1
    )
    assert lie_brackets.check(lie_brackets.linear_array(2), one).rank == 2


def test_an_array_of_nonlinear_springs_is_not_involutive():
    """Cubic dampers leave the span at once, cubic stiffness alone one bracket later."""
    report = lie_brackets.check(lie_brackets.nonlinear_array(2))
    assert (report.li, report.defect) == (True, (0, 1))
    array = lie_brackets.nonlinear_array(2)
    linear_dampers = {sp.Symbol(f"d3_{i}", positive=True): 0 for i in (1, 2)}
    system = lie_brackets.ControlSystem("", array.states, array.f.subs(linear_dampers), array.g)
    assert lie_brackets.check(system).defect == (1, 2)


def test_a_textbook_system_that_is_not_involutive():
    """Three states, [g, ad_f g] outside the span of g and ad_f g: Isidori's condition fails."""
    system = lie_brackets.ControlSystem("", (X, Y, Z), column(Y, Z + Z**2, 0), column(0, 0, 1))
    report = lie_brackets.check(system)
    assert report.li
    assert report.inv  # [g, ad_f g] = (0, -2, 0) lies along ad_f g
    other = lie_brackets.ControlSystem("", (X, Y, Z), column(Y + Z**2, Z, 0), column(0, 0, 1))
    assert lie_brackets.check(other).defect == (0, 1)


def test_wrong_arguments():
    with pytest.raises(InvalidArgumentError, match="2 components, one a state, got 1"):
        lie_brackets.ControlSystem("", (X, Y), column(X), column(0, 1))
    with pytest.raises(InvalidArgumentError, match="k: expected an integer >= 0"):
        lie_brackets.ad(lie_brackets.nonlinear_spring(), -1)
