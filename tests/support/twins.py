"""The physics once more, slowly and plainly in NumPy: what MuJoCo's runs are compared with.

Nothing here uses mcmj's simulation, callbacks or MJCF; a Body is read as a bag of arrays.
"""

from types import SimpleNamespace

import numpy as np


def cubic(x1, x2, body):
    return body.k1 * x1 + body.k3 * x1**3 + body.d1 * x2 + body.d3 * x2**3


def tansig(x1, x2, body):
    return body.k1 * np.tanh(body.k3 * x1) + body.d1 * np.tanh(body.d3 * x2)


def lengths_of(body, positions):
    a, b = body.springs.T
    return np.hypot(*(positions[..., b, :] - positions[..., a, :]).T).T


def acceleration(body, p, v, push, pull):
    """Eqs. 6 and 7: spring forces along their axes, `push` (N,) along x; fixed nodes stay."""
    a, b = body.springs.T
    axis = p[b] - p[a]
    length = np.hypot(*axis.T)
    axis = axis / length[:, None]
    rate = ((v[b] - v[a]) * axis).sum(axis=1)
    force = pull(length - body.rest_lengths, rate, body)[:, None] * axis
    total = np.zeros_like(p)
    np.add.at(total, a, force)
    np.add.at(total, b, -force)
    total[:, 0] += push
    return np.where(body.fixed[:, None], 0.0, total / body.masses[:, None])


def euler(f, p, v, h):
    """Semi-implicit: the new velocity moves the nodes."""
    v = v + h * f(p, v)
    return p + h * v, v


def rk4(f, p, v, h):
    """Classical Runge-Kutta 4."""
    v1, a1 = v, f(p, v)
    v2, a2 = v + h / 2 * a1, f(p + h / 2 * v1, v + h / 2 * a1)
    v3, a3 = v + h / 2 * a2, f(p + h / 2 * v2, v + h / 2 * a2)
    v4, a4 = v + h * a3, f(p + h * v3, v + h * a3)
    return p + h / 6 * (v1 + 2 * v2 + 2 * v3 + v4), v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)


STEPPERS = {"Euler": euler, "RK4": rk4}


def run(
    body,
    steps,
    *,
    integrator="Euler",
    timestep=1e-3,
    w_out=None,
    inputs=None,
    offset=None,
    gate=None,
    forces=None,
    delay=0,
    substeps=1,
    positions=None,
    velocities=None,
    pull=cubic,
):
    """`steps` control steps; all that pushes is held over the step. Records are at its start."""
    p = np.array(body.positions if positions is None else positions)
    v = np.zeros_like(p) if velocities is None else np.array(velocities)
    v[body.fixed] = 0.0
    gate = np.ones(body.n_outputs) if gate is None else gate
    forces = None if forces is None else np.broadcast_to(forces, (steps, body.n_nodes))
    rows = SimpleNamespace(lengths=[], outputs=[], positions=[], velocities=[])
    for k in range(steps):
        length = lengths_of(body, p)
        y = np.zeros(body.n_outputs)
        if w_out is not None:
            y = length @ w_out[: body.n_springs] + w_out[body.n_springs :].sum(axis=0)
        for name, row in (("lengths", length), ("outputs", y), ("positions", p), ("velocities", v)):
            getattr(rows, name).append(row)
        fed = gate * rows.outputs[k - delay] if k >= delay else 0.0 * y
        push = body.w_fb @ (fed + (0.0 if offset is None else offset[k]))
        if inputs is not None:
            push = push + body.w_in @ inputs[k]
        if forces is not None:
            push = push + forces[k]

        def f(p, v, push=push):
            return acceleration(body, p, v, push, pull)

        for _ in range(substeps):
            p, v = STEPPERS[integrator](f, p, v, timestep / substeps)
    names = ("lengths", "outputs", "positions", "velocities")
    return SimpleNamespace(**{name: np.array(getattr(rows, name)) for name in names}, end=(p, v))
