"""Bodies around a drawn one: each group of parameters changes its own numbers, by its formula."""

from dataclasses import fields

import numpy as np
import pytest

import mcmj
from mcmj.core.body import spring_lengths
from mcmj.search.body_space import PUSH, SHIFT, STRESS, VARIED, BodySpace
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError

BODY = mcmj.random_body(3, nodes=7, masses=(0.5, 2.0))
CHANGES = {
    "springs": {"k1", "k3", "d1", "d3"},
    "rest_lengths": {"rest_lengths"},
    "positions": {"positions", "rest_lengths"},
    "masses": {"masses"},
    "feedback": {"w_fb"},
}


def at_random(space, size=1.0):
    return np.random.default_rng(0).uniform(-size, size, space.size)


def test_zero_is_the_drawn_body_to_the_bit():
    space = BodySpace(BODY, tuple(VARIED))
    assert space.body(np.zeros(space.size)) == BODY
    n, springs, free = BODY.n_nodes, BODY.n_springs, len(BODY.free)
    assert space.size == 5 * springs + 2 * n + free + 2 * free


@pytest.mark.parametrize("name", VARIED)
def test_a_group_changes_its_own_arrays_only(name):
    space = BodySpace(BODY, (name,))
    other = space.body(at_random(space, 0.5))
    same = {f.name for f in fields(BODY) if (getattr(other, f.name) == getattr(BODY, f.name)).all()}
    assert {f.name for f in fields(BODY)} - same == CHANGES[name]
    assert (other.springs == BODY.springs).all()
    assert (other.fixed == BODY.fixed).all()


def test_the_formulas():
    x = at_random(BodySpace(BODY, ("springs",)))
    springs = BodySpace(BODY, ("springs",)).body(x)
    count = BODY.n_springs
    for k, name in enumerate(("k1", "k3", "d1", "d3")):
        ratio = np.log(getattr(springs, name) / getattr(BODY, name))
        np.testing.assert_allclose(ratio, x[k * count : (k + 1) * count], atol=1e-14)
    one = np.ones
    stressed = BodySpace(BODY, ("rest_lengths",)).body(one(count))
    np.testing.assert_allclose(stressed.rest_lengths - BODY.rest_lengths, STRESS, rtol=1e-10)
    heavy = BodySpace(BODY, ("masses",)).body(one(len(BODY.free)))
    np.testing.assert_allclose((heavy.masses / BODY.masses)[BODY.free], np.e, rtol=1e-14)
    pushed = BodySpace(BODY, ("feedback",)).body(one(2 * len(BODY.free)))
    np.testing.assert_allclose((pushed.w_fb - BODY.w_fb)[BODY.free], PUSH, rtol=1e-12)
    assert not (pushed.w_fb - BODY.w_fb)[BODY.fixed].any()
    moved = BodySpace(BODY, ("positions",)).body(one(BODY.positions.size))
    np.testing.assert_allclose(moved.positions - BODY.positions, SHIFT, rtol=1e-12)


def test_a_body_whose_nodes_move_keeps_its_stress():
    space = BodySpace(BODY, ("rest_lengths", "positions"))
    x = at_random(space)
    body = space.body(x)
    stretch = body.rest_lengths - spring_lengths(body.positions, body.springs)
    np.testing.assert_allclose(stretch, STRESS * x[: BODY.n_springs], atol=1e-12)


def test_a_designed_body_comes_back_from_its_file_to_the_bit():
    space = BodySpace(BODY, tuple(VARIED))
    body = space.body(at_random(space))
    w_out = np.random.default_rng(1).standard_normal((body.n_springs, 2))
    again, readout = mcmj.from_mjcf(mcmj.to_mjcf(body, w_out=w_out))
    assert again == body
    assert (readout == w_out).all()


def test_what_cannot_be_is_refused():
    with pytest.raises(UnknownNameError, match="valid choices: feedback, masses, positions"):
        BodySpace(BODY, ("colour",))
    with pytest.raises(InvalidArgumentError, match="at least one, each once"):
        BodySpace(BODY, ())
    space = BodySpace(BODY, ("rest_lengths",))
    with pytest.raises(InvalidArgumentError, match=r"shape \(\d+\)"):
        space.body(np.zeros(3))
    with pytest.raises(InvalidArgumentError, match="rest_lengths"):
        space.body(np.full(space.size, -1e4))
