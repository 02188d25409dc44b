"""Feedback linearisability (Hauser et al. 2012, appendices B and D), symbolically.

    x' = f(x) + g(x) u,        [f, g] = (dg/dx) f - (df/dx) g
    ad_f^0 g = g,              ad_f^k g = [f, ad_f^(k-1) g]

A static feedback u = K(x, v) turns the system of order n into a chain of n integrators around
x0, by a change of coordinates, if and only if (Isidori, Nonlinear Control Systems, 1995)

    LI   g, ad_f g, ..., ad_f^(n-1) g are linearly independent at x0,
    INV  span {g, ad_f g, ..., ad_f^(n-2) g} is involutive around x0: it holds the brackets of
         its own fields.

Then static feedback can make it any system of order n (Hauser et al. 2012, Theorem 1).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.extras import extra
from mcmj.utils.validation import require_count

with extra("theory", "Lie brackets need SymPy"):
    import sympy as sp
    from sympy.polys.matrices import DomainMatrix

Point = dict[sp.Symbol, sp.Expr]

LONGEST = 100  # letters of an expression that a message shows


@dataclass(frozen=True)
class ControlSystem:
    """x' = f(x) + g(x) u as expressions.

    Attributes:
        name: for reports.
        states: the n symbols x.
        f: drift, n expressions.
        g: input field, n expressions.

    Raises:
        InvalidArgumentError: not n components.
    """

    name: str
    states: tuple[sp.Symbol, ...]
    f: sp.Matrix
    g: sp.Matrix

    def __post_init__(self) -> None:
        for name in ("f", "g"):
            column = sp.Matrix(list(getattr(self, name)))
            if len(column) != len(self.states):
                raise InvalidArgumentError(
                    name, f"{len(self.states)} components, one a state", len(column)
                )
            object.__setattr__(self, name, column)

    @property
    def order(self) -> int:
        """n."""
        return len(self.states)


@dataclass(frozen=True)
class Linearisability:
    """What the conditions say about a system around a point.

    Attributes:
        system: the system.
        point: x0 and, if the system has some, values of parameters.
        fields: g, ad_f g, ..., ad_f^(n-1) g.
        determinant: of the matrix of these fields at the point, factored; 0 if LI fails.
        rank: of that matrix; n if LI holds.
        defect: None if INV holds, else the first pair (i, j) such that [ad_f^i g, ad_f^j g]
            leaves the distribution, or () if the distribution is singular at the point.
    """

    system: ControlSystem
    point: Point
    fields: tuple[sp.Matrix, ...]
    determinant: sp.Expr
    rank: int
    defect: tuple[int, ...] | None

    @property
    def li(self) -> bool:
        """Linear independence at the point."""
        return self.rank == self.system.order

    @property
    def inv(self) -> bool:
        """Involutivity around the point."""
        return self.defect is None

    @property
    def linearisable(self) -> bool:
        """Both conditions hold."""
        return self.li and self.inv

    def __str__(self) -> str:
        n = self.system.order
        lines = [f"{self.system.name}: order {n}"]
        lines += [
            f"  ad_f^{k} g = {_shortened(list(field))}" for k, field in enumerate(self.fields[:4])
        ]
        if n > 4:
            lines.append(f"  ... up to ad_f^{n - 1} g")
        lines.append(f"  LI   {'holds' if self.li else 'fails'}: rank {self.rank} of {n}; ")
        lines[-1] += f"det = {_shortened(self.determinant)}"
        lines.append(f"  INV  {self._involutivity()}")
        lines.append(f"  feedback linearisable: {'yes' if self.linearisable else 'no'}")
        return "\n".join(lines)

    def _involutivity(self) -> str:
        if self.defect is None:
            return "holds"
        if not self.defect:
            return "fails: the distribution is singular at the point"
        i, j = self.defect
        return f"fails: [ad_f^{i} g, ad_f^{j} g] leaves the distribution"


def lie_bracket(f: sp.Matrix, g: sp.Matrix, states: Sequence[sp.Symbol]) -> sp.Matrix:
    """[f, g] = (dg/dx) f - (df/dx) g, expanded."""
    return sp.expand(g.jacobian(list(states)) * f - f.jacobian(list(states)) * g)


def ad(system: ControlSystem, k: int) -> sp.Matrix:
    """ad_f^k g = [f, [f, ... [f, g]]], k brackets.

    Raises:
        InvalidArgumentError: k is not an integer >= 0.
    """
    require_count("k", k, 0)
    field = system.g
    for _ in range(k):
        field = lie_bracket(system.f, field, system.states)
    return field


def check(system: ControlSystem, point: Point | None = None) -> Linearisability:
    """The conditions LI and INV around a point (default: the origin, parameters as they are).

    INV is decided exactly. Where the n - 1 fields of the distribution have full rank, a bracket
    lies in their span around the point if and only if the determinant of the fields and the
    bracket is identically 0.
    """
    place = dict.fromkeys(system.states, sp.Integer(0)) | (point or {})
    fields = [system.g]
    for _ in range(system.order - 1):
        fields.append(lie_bracket(system.f, fields[-1], system.states))
    matrix = sp.Matrix.hstack(*fields).subs(place)
    determinant = _determinant(matrix)
    return Linearisability(
        system=system,
        point=place,
        fields=tuple(fields),
        determinant=sp.factor(determinant),
        rank=_rank(matrix) if determinant == 0 else system.order,
        defect=_defect(system, fields[:-1], place),
    )


def _defect(
    system: ControlSystem, distribution: list[sp.Matrix], place: Point
) -> tuple[int, ...] | None:
    """The first pair of fields whose bracket leaves their span; () where that is singular."""
    for i, j in combinations(range(len(distribution)), 2):
        bracket = lie_bracket(distribution[i], distribution[j], system.states)
        if bracket.is_zero_matrix:
            continue
        square = sp.Matrix.hstack(*distribution, bracket)
        if _determinant(square.subs(_somewhere(square))) != 0 or _determinant(square) != 0:
            return (i, j)
    regular = _rank(sp.Matrix.hstack(*distribution).subs(place)) == len(distribution)
    constant = not any(field.free_symbols & set(system.states) for field in distribution)
    return None if regular or constant else ()


def _somewhere(matrix: sp.Matrix) -> Point:
    """A point that is special for nothing: a determinant that is not 0 there is not 0."""
    symbols = sorted(matrix.free_symbols, key=str)
    return {s: sp.Rational(sp.prime(i + 5), sp.prime(i + 2)) for i, s in enumerate(symbols)}


def _determinant(matrix: sp.Matrix) -> sp.Expr:
    domain = DomainMatrix.from_Matrix(matrix)
    return sp.expand(domain.domain.to_sympy(domain.det()))


def _rank(matrix: sp.Matrix) -> int:
    """Exact; symbols that are left stand for parameters in general position."""
    return int(DomainMatrix.from_Matrix(matrix).to_field().rank())


def _shortened(expression: object) -> str:
    text = str(expression)
    return text if len(text) <= LONGEST else f"{text[:LONGEST]} ..."


# --- the systems of the paper ------------------------------------------------------------------


def nonlinear_spring() -> ControlSystem:
    """Eq. (1): one mass on one spring, x1' = x2, x2' = (-p(x1) - q(x2) + u) / m."""
    m = sp.Symbol("m", positive=True)
    return _array("nonlinear spring", 1, "", m, cubic=True)


def linear_array(masses: int) -> ControlSystem:
    """Appendix E: linear springs k_i, d_i pushed by one input, x_i'' = (-k_i x_i - d_i x_i' + u)/m.

    Raises:
        InvalidArgumentError: not at least one mass.
    """
    return _array(f"array of {masses} linear springs", masses, "_", sp.Integer(1), cubic=False)


def equal_array(masses: int) -> ControlSystem:
    """`linear_array` without diversity: all springs alike.

    Raises:
        InvalidArgumentError: not at least one mass.
    """
    array = linear_array(masses)
    alike = {
        sp.Symbol(f"{s}_{i}", positive=True): sp.Symbol(s, positive=True)
        for s in ("k1", "d1")
        for i in range(1, masses + 1)
    }
    name = f"array of {masses} equal linear springs"
    return ControlSystem(name, array.states, array.f.subs(alike), array.g)


def nonlinear_array(masses: int) -> ControlSystem:
    """The same with cubic stiffness and damping.

    Raises:
        InvalidArgumentError: not at least one mass.
    """
    return _array(f"array of {masses} nonlinear springs", masses, "_", sp.Integer(1), cubic=True)


def _array(name: str, masses: int, mark: str, mass: sp.Expr, *, cubic: bool) -> ControlSystem:
    require_count("masses", masses, 1)
    states, f, g = [], [], []
    for i in range(1, masses + 1):
        label = f"{mark}{i}" if mark else ""
        x, v = (sp.Symbol(f"{s}{label}") for s in (("x", "v") if mark else ("x1", "x2")))
        k1, k3, d1, d3 = (sp.Symbol(f"{s}{label}", positive=True) for s in ("k1", "k3", "d1", "d3"))
        pull = k1 * x + d1 * v + (k3 * x**3 + d3 * v**3 if cubic else 0)
        states += [x, v]
        f += [v, -pull / mass]
        g += [sp.Integer(0), 1 / mass]
    return ControlSystem(name, tuple(states), sp.Matrix(f), sp.Matrix(g))
