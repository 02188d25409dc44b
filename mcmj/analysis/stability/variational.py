"""Linearised step map of a closed loop, analytically, in plain NumPy: no twin, no MuJoCo.

One step of MuJoCo's Euler, v+ = v + h M^-1 F(p, v), p+ = p + h v+, has the derivative

    dv+ = dv + h M^-1 (A dp + B dv),   dp+ = dp + h dv+

A and B sum over springs with gap g, axis e = g / l, relative velocity w, rate r = e . w and
tension s = p(l - l0) + q(r); the force on the tail is s e, the opposite on the head:

    d(s e) = [e (p' e + q' (w - r e) / l)^T + (s / l) (1 - e e^T)] dg + q' e e^T dw

and A has w_fb (W_out^T dl/dp) in its x rows. All terms are kept, turning springs included
(`mcmj.simulation.stepsize.linearisation` leaves out those of first order in their velocity).
"""

import numpy as np

from mcmj.analysis.stability.cycle import weights_at
from mcmj.analysis.stability.loop import ClosedLoop, require_planar
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array

_ONE = np.eye(2)


class StepMap:
    """z -> Phi(z) and the parts of DPhi(z), for one state (n,) of a planar body.

    Raises:
        InvalidArgumentError: another kind of loop.
    """

    def __init__(self, loop: ClosedLoop) -> None:
        require_planar(loop, "are linearised exactly; `multipliers_of` takes any loop")
        body = loop.body
        self._body, self._step = body, loop.timestep
        free = body.free
        self._inverse_mass = np.repeat(1.0 / body.masses[free], 2)
        incidence = np.zeros((body.n_springs, body.n_nodes))
        rows = np.arange(body.n_springs)
        incidence[rows, body.springs[:, 0]], incidence[rows, body.springs[:, 1]] = -1.0, 1.0
        self._all, self._free = incidence, incidence[:, free]
        self._loop = loop
        self._push = body.w_fb[free]
        self._readout = loop.readout

    def __call__(self, state: Array) -> tuple[Array, Array, Array]:
        """Next state (n,), and (n / 2, n / 2) by which dv+ = dv + h/m A dp + h/m B dv."""
        body, h, half = self._body, self._step, len(state) // 2
        positions, velocities = self._loop.nodes(state)
        gap, w = self._all @ positions, self._all @ velocities
        length = np.sqrt((gap**2).sum(axis=1))
        e = gap / length[:, None]
        rate = (e * w).sum(axis=1)
        x1 = length - body.rest_lengths
        tension = x1 * (body.k1 + body.k3 * x1**2) + rate * (body.d1 + body.d3 * rate**2)
        p, q = body.k1 + 3 * body.k3 * x1**2, body.d1 + 3 * body.d3 * rate**2
        force = -self._free.T @ (tension[:, None] * e)
        force[:, 0] += self._push @ self._readout.outputs(length)
        slope = p[:, None] * e + (q / length)[:, None] * (w - rate[:, None] * e)
        across = _ONE - e[:, :, None] * e[:, None, :]
        by_gap = e[:, :, None] * slope[:, None, :] + (tension / length)[:, None, None] * across
        by_w = (q[:, None] * e)[:, :, None] * e[:, None, :]
        A, B = self._assembled(by_gap), self._assembled(by_w)
        along = (self._free[:, :, None] * e[:, None, :]).reshape(len(e), half)  # dl/dp
        A[::2] += self._push @ (self._readout.weights.T @ along)
        kick = h * self._inverse_mass[:, None]
        v = state[half:] + kick[:, 0] * force.ravel()
        return np.concatenate([state[:half] + h * v, v]), kick * A, kick * B

    def _assembled(self, blocks: Array) -> Array:
        """-sum of incidence^T block incidence, (half, half), of blocks (L, 2, 2)."""
        free = self._free
        nodes = free.shape[1]
        total = np.empty((nodes, 2, nodes, 2))
        for i in range(2):
            for j in range(2):
                total[:, i, :, j] = -(free.T * blocks[:, i, j]) @ free
        return total.reshape(2 * nodes, 2 * nodes)


def step_jacobian(loop: ClosedLoop, state: Array) -> Array:
    """DPhi (n, n) at a state (n,)."""
    _, A, B = StepMap(loop)(state)
    return np.vstack(_propagated(np.eye(loop.size), A, B, loop.timestep))


def _propagated(derivative: Array, A: Array, B: Array, h: float) -> tuple[Array, Array]:
    """DPhi times `derivative` (n, m), its positions' and velocities' rows."""
    half = len(A)
    dp, dv = derivative[:half], derivative[half:]
    dv = dv + A @ dp + B @ dv
    return dp + h * dv, dv


def variational(loop: ClosedLoop, state: Array, duration: float) -> tuple[Array, Array]:
    """State (n,) after a duration [s], and its derivative (n, n) by the start.

    Between steps both are interpolated as `cycle.flow_map` does.

    Raises:
        InvalidArgumentError: a duration shorter than two steps.
    """
    steps = int(duration / loop.timestep)
    if steps < 2:
        raise InvalidArgumentError("duration", "at least two steps", f"{duration:g} s")
    advance, weights = StepMap(loop), weights_at(duration / loop.timestep - steps)
    derivative = np.eye(loop.size)
    end, monodromy = np.zeros(loop.size), np.zeros_like(derivative)
    for k in range(1, steps + 3):
        state, A, B = advance(state)
        derivative = np.concatenate(_propagated(derivative, A, B, loop.timestep))
        if k >= steps - 1:
            weight = weights[k - steps + 1]
            end += weight * state
            monodromy += weight * derivative
    return end, monodromy
