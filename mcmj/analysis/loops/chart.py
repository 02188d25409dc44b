"""The state of any MuJoCo model as a vector of plain numbers, about a reference configuration.

    z = (dq (nv,), v (nv,), act (na,))

Hinges and slides: dq and v are joint angle or position minus the reference's, and velocity. Ball
joints: dq is the rotation vector from the reference in the joint's frame, as mj_differentiatePos
has it. Free joints: position minus the reference's; orientation as swing and yaw from the
reference (`rotations.swing_and_yaw`); all velocities in the body's own frame. A model that
nothing ties to a place or a heading then has coordinates that its motion does not depend on.
"""

from collections.abc import Iterator

import mujoco
import numpy as np
import numpy.typing as npt

from mcmj.analysis.loops import rotations
from mcmj.utils.validation import Array

_FREE, _BALL = mujoco.mjtJoint.mjJNT_FREE.value, mujoco.mjtJoint.mjJNT_BALL.value
_SLIDE = mujoco.mjtJoint.mjJNT_SLIDE.value
_FREE_NAMES = ("x", "y", "z", "swing_x", "swing_y", "yaw")


class Chart:
    """Coordinates of a model's states.

    Args:
        model: compiled.
        reference: joint positions (nq,) that dq counts from.
    """

    def __init__(self, model: mujoco.MjModel, reference: Array) -> None:
        self.nv, self.na = int(model.nv), int(model.na)
        self.reference = reference
        joints = [model.joint(j) for j in range(model.njnt)]
        kinds = [int(joint.type[0]) for joint in joints]
        starts = [(int(joint.qposadr[0]), int(joint.dofadr[0])) for joint in joints]
        places = list(zip(kinds, starts, strict=True))
        self._free = [at for kind, at in places if kind == _FREE]
        self._ball = [at for kind, at in places if kind == _BALL]
        plain = [at for kind, at in places if kind not in (_FREE, _BALL)]
        plain += [(q + i, v + i) for q, v in self._free for i in range(3)]
        self._plain = tuple(np.array(plain, dtype=np.int64).reshape(-1, 2).T)
        self.names = tuple(name for joint in joints for name in _names(joint))
        self._linear = np.zeros(self.nv, np.bool_)
        for kind, (_, dof) in places:
            self._linear[dof : dof + 3 if kind == _FREE else dof + (kind == _SLIDE)] = True

    @property
    def size(self) -> int:
        """2 nv + na."""
        return 2 * self.nv + self.na

    def coordinates(self, qpos: Array, qvel: Array, act: Array) -> Array:
        """z (B, size) of states (B, nq), (B, nv), (B, na)."""
        dq, v = np.empty_like(qvel), qvel.copy()
        places, dofs = self._plain
        dq[:, dofs] = qpos[:, places] - self.reference[places]
        for q, dof in self._ball:
            back = rotations.inverse(self.reference[q : q + 4])
            turn = rotations.product(back, qpos[:, q : q + 4])
            dq[:, dof : dof + 3] = rotations.to_vector(turn)
        for q, dof in self._free:
            now = qpos[:, q + 3 : q + 7]
            turn = rotations.product(now, rotations.inverse(self.reference[q + 3 : q + 7]))
            dq[:, dof + 3 : dof + 6] = rotations.swing_and_yaw(turn)
            v[:, dof : dof + 3] = rotations.turned(rotations.inverse(now), qvel[:, dof : dof + 3])
        return np.hstack([dq, v, act])

    def state(self, z: Array) -> tuple[Array, Array, Array]:
        """qpos (B, nq), qvel (B, nv) and act (B, na) at z (B, size)."""
        dq, v, act = np.split(z, [self.nv, 2 * self.nv], axis=1)
        qpos, qvel = np.tile(self.reference, (len(z), 1)), v.copy()
        places, dofs = self._plain
        qpos[:, places] += dq[:, dofs]
        for q, dof in self._ball:
            turn = rotations.from_vector(dq[:, dof : dof + 3])
            qpos[:, q : q + 4] = rotations.product(self.reference[q : q + 4], turn)
        for q, dof in self._free:
            turn = rotations.from_swing_and_yaw(dq[:, dof + 3 : dof + 6])
            now = rotations.product(turn, self.reference[q + 3 : q + 7])
            qpos[:, q + 3 : q + 7] = now
            qvel[:, dof : dof + 3] = rotations.turned(now, v[:, dof : dof + 3])
        return qpos, qvel, act

    def groups(self) -> Iterator[npt.NDArray[np.int64]]:
        """Coordinates of one unit each: positions [m], angles [rad], their rates, activations."""
        for start in (0, self.nv):
            for kind in (self._linear, ~self._linear):
                yield start + np.flatnonzero(kind)
        yield np.arange(2 * self.nv, self.size)


def _names(joint: object) -> list[str]:
    """Of the degrees of freedom of a joint."""
    name, kind = joint.name or f"joint{joint.id}", int(joint.type[0])  # type: ignore[attr-defined]
    if kind == _FREE:
        return [f"{name}:{part}" for part in _FREE_NAMES]
    return [f"{name}:{axis}" for axis in "xyz"] if kind == _BALL else [name]
