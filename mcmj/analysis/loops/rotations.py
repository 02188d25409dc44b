"""Unit quaternions (.., 4), w first as in MuJoCo, and rotation vectors (.., 3) [rad].

Turned by q, a vector v is q (0, v) q*; a product a b turns by b first.
"""

import numpy as np

from mcmj.utils.validation import Array


def product(a: Array, b: Array) -> Array:
    """a b, (.., 4)."""
    wa, va, wb, vb = a[..., :1], a[..., 1:], b[..., :1], b[..., 1:]
    w = wa * wb - (va * vb).sum(axis=-1, keepdims=True)
    found: Array = np.concatenate([w, wa * vb + wb * va + np.cross(va, vb)], axis=-1)
    return found


def inverse(q: Array) -> Array:
    """q* (.., 4)."""
    found: Array = q * np.array([1.0, -1.0, -1.0, -1.0])
    return found


def turned(q: Array, v: Array) -> Array:
    """v (.., 3) turned by q."""
    pure = np.concatenate([np.zeros_like(v[..., :1]), v], axis=-1)
    return product(product(q, pure), inverse(q))[..., 1:]


def from_vector(vector: Array) -> Array:
    """Quaternions of rotation vectors: exp(vector / 2)."""
    half = np.linalg.norm(vector, axis=-1, keepdims=True) / 2
    return np.concatenate([np.cos(half), np.sinc(half / np.pi) * vector / 2], axis=-1)


def to_vector(q: Array) -> Array:
    """Rotation vectors of quaternions, no longer than pi."""
    q = np.where(q[..., :1] < 0, -q, q)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    half = np.arctan2(sine, q[..., :1])
    found: Array = 2 * q[..., 1:] / np.sinc(half / np.pi)
    return found


def swing_and_yaw(q: Array) -> Array:
    """(swing_x, swing_y, yaw) of q = turn(yaw about z) x turn(swing), the swing's axis level.

    Turning all by an angle about the vertical adds it to the yaw and changes nothing else.
    Undefined where the swing is pi: upside down.
    """
    yaw = 2 * np.arctan2(q[..., 3:], q[..., :1])
    yaw = (yaw + np.pi) % (2 * np.pi) - np.pi
    swing = to_vector(product(inverse(_about_vertical(yaw)), q))
    return np.concatenate([swing[..., :2], yaw], axis=-1)


def from_swing_and_yaw(angles: Array) -> Array:
    """Quaternions of (swing_x, swing_y, yaw)."""
    level = angles * np.array([1.0, 1.0, 0.0])
    return product(_about_vertical(angles[..., 2:]), from_vector(level))


def _about_vertical(yaw: Array) -> Array:
    zero = np.zeros_like(yaw)
    return np.concatenate([np.cos(yaw / 2), zero, zero, np.sin(yaw / 2)], axis=-1)
