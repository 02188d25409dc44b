"""What tests of rollouts share: how equal two must be, variants, parts, an exact solution."""

from types import SimpleNamespace

import numpy as np

from mcmj import Body

ALL = ("lengths", "outputs", "positions", "velocities")
T = 300
# measured: at most 5e-13 m on lengths up to 80 m
SAME = {"lengths": 3e-12, "outputs": 3e-13, "positions": 3e-12, "velocities": 2e-12}
VARIANTS = [
    {},
    {"integrator": "RK4"},
    {"integrator": "discrete"},
    {"feedback_delay": 2},
    {"substeps": 3},
    {"substeps": 3, "feedback_delay": 1},
    {"springs": "cubic"},
]


def assert_same(rollout, twin):
    for name, limit in SAME.items():
        assert np.abs(getattr(rollout, name) - getattr(twin, name)).max() < limit, name


def same_bits(one, other, names=ALL):
    """Everything to the bit; outputs, a BLAS product of the lengths, to its rounding."""
    close = "outputs" not in names or np.abs(one.outputs - other.outputs).max() < 3e-14
    return close and all(
        getattr(one, n).tobytes() == getattr(other, n).tobytes() for n in names if n != "outputs"
    )


def join(parts):
    """Consecutive trajectories as one."""
    axis = {"times": 0, "lengths": -2, "outputs": -2, "positions": -3, "velocities": -3}
    return SimpleNamespace(
        **{n: np.concatenate([getattr(p, n) for p in parts], axis=a) for n, a in axis.items()}
    )


def part(drive, start, stop):
    return {n: value if n == "gate" else value[start:stop] for n, value in drive.items()}


def changed(body, **arrays):
    return Body(**{n: getattr(body, n) for n in Body.__dataclass_fields__} | arrays)


def exact_oscillator(body, times, force=0.0):
    """(x, v) of m x'' = -k x - d x' + force from x = 0.5 at rest."""
    k, d, m = body.k1[0], body.d1[0], body.masses[1]
    decay, start = d / (2 * m), 0.5 - force / k
    w = np.sqrt(k / m - decay**2)
    envelope = start * np.exp(-decay * times)
    x = force / k + envelope * (np.cos(w * times) + decay / w * np.sin(w * times))
    v = -envelope * (w + decay**2 / w) * np.sin(w * times)
    return np.column_stack([x, v])
