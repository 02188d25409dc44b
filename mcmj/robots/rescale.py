"""The same body at another pace, size and weight: Eqs. 6 and 7 in other units.

With time t -> t / a, lengths x -> b x and masses m -> c m, every force of the equations of
motion grows by a^2 b c if

    k1 -> c a^2 k1     k3 -> c a^2 / b^2 k3     w_fb, w_in -> a^2 b c (w_fb, w_in)
    d1 -> c a d1       d3 -> c / (a b^2) d3

and the motion is the same, a times faster and b times larger. Lengths grow by b, hence the
readout W -> W / b gives the same outputs (a readout's bias stays). A step of h / a then makes
the rounding errors of a step of h, and of the same kind: powers of two change no bit.
"""

from dataclasses import replace

from mcmj.core.body import Body
from mcmj.core.readout import checked_readout
from mcmj.utils.validation import Array, require_number

SIZE = 1 / 32  # of a robot's body: 100 m become 3 m; changes no bit


def rescaled(body: Body, *, pace: float = 1.0, size: float = 1.0, mass: float = 1.0) -> Body:
    """A body whose motion is `pace` times faster, `size` times larger, `mass` times heavier.

    Raises:
        InvalidArgumentError: a factor that is not above 0.
    """
    for name, factor in (("pace", pace), ("size", size), ("mass", mass)):
        require_number(name, factor, 0.0, open_low=True)
    stiffness, force = mass * pace**2, mass * size * pace**2
    return replace(
        body,
        positions=size * body.positions,
        rest_lengths=size * body.rest_lengths,
        k1=stiffness * body.k1,
        k3=stiffness / size**2 * body.k3,
        d1=mass * pace * body.d1,
        d3=mass / (pace * size**2) * body.d3,
        w_in=force * body.w_in,
        w_fb=force * body.w_fb,
        masses=mass * body.masses,
    )


def rescaled_readout(body: Body, w_out: object, *, size: float) -> Array:
    """The readout of `rescaled(body, size=size)` that gives the outputs of `w_out` on `body`.

    Args:
        w_out: (L, n_outputs), or (L + 1, n_outputs) with a bias.

    Raises:
        InvalidArgumentError: wrong shape, or a size that is not above 0.
    """
    require_number("size", size, 0.0, open_low=True)
    scaled = checked_readout(body, w_out).copy()
    scaled[: body.n_springs] /= size
    return scaled
