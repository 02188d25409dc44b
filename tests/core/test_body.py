"""Body: what is accepted, what is refused and by which name, what is read-only."""

import copy
import dataclasses
import pickle

import numpy as np
import pytest

from mcmj import Body
from mcmj.core.body import spring_lengths
from mcmj.utils.errors import InvalidArgumentError, McmjError

SQUARE = {
    "positions": [[0.0, 0.0], [3.0, 0.0], [3.0, 4.0], [-1.0, 4.0]],
    "springs": [[0, 1], [1, 2], [2, 3], [3, 0], [0, 2]],
    "k1": [1.0, 2.0, 3.0, 4.0, 5.0],
    "k3": [0.0, 10.0, 20.0, 30.0, 40.0],
    "d1": [0.1, 0.2, 0.3, 0.4, 0.5],
    "d3": [1.0, 2.0, 0.0, 4.0, 5.0],
    "fixed": [True, False, False, False],
}
FIVE = np.ones(5)
NAN = np.array([1.0, 1.0, np.nan, 1.0, 1.0])


def square(**changes):
    return Body(**SQUARE | changes)


REFUSED = {
    "coincident nodes": ("positions", {"positions": [[0, 0], [3, 0], [3, 4], [0, 0]]}),
    "NaN position": ("positions", {"positions": [[0, 0], [3, 0], [np.nan, 4], [-1, 4]]}),
    "infinite position": ("positions", {"positions": [[0, 0], [3, 0], [np.inf, 4], [-1, 4]]}),
    "positions on a line": ("positions", {"positions": np.eye(4, 1)}),
    "positions in 4D": ("positions", {"positions": np.eye(4)}),
    "direction 0": ("direction", {"direction": [0, 0]}),
    "direction in 3D": ("direction", {"direction": [1, 0, 0]}),
    "direction NaN": ("direction", {"direction": [1, np.nan]}),
    "text for positions": ("positions", {"positions": "somewhere"}),
    "one node": ("positions", {"positions": [[0, 0]]}),
    "spring to itself": ("springs", {"springs": [[0, 1], [1, 2], [2, 3], [3, 3], [0, 2]]}),
    "spring twice": ("springs", {"springs": [[0, 1], [1, 2], [2, 3], [3, 0], [0, 1]]}),
    "spring there and back": ("springs", {"springs": [[0, 1], [1, 2], [2, 3], [3, 0], [1, 0]]}),
    "index too large": ("springs", {"springs": [[0, 1], [1, 2], [2, 4], [3, 0], [0, 2]]}),
    "negative index": ("springs", {"springs": [[0, 1], [1, 2], [2, -1], [3, 0], [0, 2]]}),
    "index between": ("springs", {"springs": [[0, 1], [1, 2], [2, 2.5], [3, 0], [0, 2]]}),
    "springs of 3 ends": ("springs", {"springs": [[0, 1, 2]] * 5}),
    "disconnected": (
        "springs",
        {"springs": [[0, 1], [1, 2], [0, 2]]}
        | {name: SQUARE[name][:3] for name in ("k1", "k3", "d1", "d3")},
    ),
    "k1 zero": ("k1", {"k1": FIVE * [1, 1, 0, 1, 1]}),
    "k1 negative": ("k1", {"k1": -FIVE}),
    "d1 zero": ("d1", {"d1": 0 * FIVE}),
    "k3 negative": ("k3", {"k3": -FIVE}),
    "d3 negative": ("d3", {"d3": -FIVE}),
    "k1 NaN": ("k1", {"k1": NAN}),
    "k3 NaN": ("k3", {"k3": NAN}),
    "d1 NaN": ("d1", {"d1": NAN}),
    "d3 NaN": ("d3", {"d3": NAN}),
    "too few k1": ("k1", {"k1": FIVE[:4]}),
    "scalar d3": ("d3", {"d3": 1.0}),
    "rest length zero": ("rest_lengths", {"rest_lengths": FIVE * [1, 0, 1, 1, 1]}),
    "rest length NaN": ("rest_lengths", {"rest_lengths": NAN}),
    "too many rest lengths": ("rest_lengths", {"rest_lengths": np.ones(6)}),
    "mass zero": ("masses", {"masses": [1, 1, 0, 1]}),
    "mass negative": ("masses", {"masses": [1, 1, -2, 1]}),
    "mass NaN": ("masses", {"masses": [1, np.nan, 1, 1]}),
    "mass per spring": ("masses", {"masses": FIVE}),
    "w_in without channels": ("w_in", {"w_in": np.ones(4)}),
    "w_in per spring": ("w_in", {"w_in": np.ones((5, 1))}),
    "w_in NaN": ("w_in", {"w_in": np.full((4, 1), np.nan)}),
    "w_fb transposed": ("w_fb", {"w_fb": np.ones((2, 4))}),
    "w_fb infinite": ("w_fb", {"w_fb": np.full((4, 2), np.inf)}),
    "all fixed": ("fixed", {"fixed": [True] * 4}),
    "fixed per spring": ("fixed", {"fixed": [True] + [False] * 4}),
    "fixed as indices": ("fixed", {"fixed": [0, 3, 0, 0]}),
}


@pytest.mark.parametrize("case", REFUSED)
def test_invalid_body_is_refused_by_name(case):
    name, changes = REFUSED[case]
    with pytest.raises(InvalidArgumentError) as caught:
        square(**changes)
    assert caught.value.name == name
    assert str(caught.value).startswith(f"{name}: expected ")


def test_errors_are_mcmj_errors_and_value_errors():
    for base in (McmjError, ValueError):
        with pytest.raises(base, match="k1"):
            square(k1=-FIVE)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"k1": FIVE[:4]}, "k1: expected shape (5), got shape (4,)"),
        ({"w_fb": np.ones((2, 4))}, "w_fb: expected shape (4, any), got shape (2, 4)"),
        ({"d1": 0 * FIVE}, "d1: expected all entries > 0, got 0 at index 0"),
        ({"k1": NAN}, "k1: expected finite numbers, got nan at index (2,)"),
        (
            {"positions": [[0, 0], [3, 0], [3, 4], [0, 0]]},
            "positions: expected distinct points, got nodes 0 and 3 both at [0. 0.]",
        ),
    ],
)
def test_message_says_what_was_expected_and_what_came(changes, text):
    with pytest.raises(InvalidArgumentError) as caught:
        square(**changes)
    assert str(caught.value) == text


def test_two_nodes_need_a_free_one():
    """By default both ends of the only spring are fixed, which leaves nothing to move."""
    with pytest.raises(InvalidArgumentError, match="fixed"):
        Body([[0, 0], [1, 0]], [[0, 1]], [1], [0], [1], [0])


def test_default_fixed_nodes_are_leftmost_and_rightmost():
    body = Body(**{name: value for name, value in SQUARE.items() if name != "fixed"})
    # node 3 is leftmost; nodes 1 and 2 are equally far right
    assert body.fixed.tolist() in ([False, True, False, True], [False, False, True, True])


def test_default_rest_lengths_are_the_distances_at_the_start():
    assert square().rest_lengths == pytest.approx([3, 4, 4, np.sqrt(17), 5], rel=1e-15)


def test_other_defaults():
    body = square()
    assert body.masses.tolist() == [1.0] * 4
    assert body.w_in.shape == body.w_fb.shape == (4, 0)


def test_sizes():
    body = square(w_in=np.ones((4, 3)), w_fb=np.ones((4, 2)))
    sizes = (body.n_nodes, body.n_springs, body.n_inputs, body.n_outputs)
    assert sizes == (4, 5, 3, 2)
    assert body.free.tolist() == [1, 2, 3]
    assert repr(body) == "Body(4 nodes, 5 springs, 1 fixed, 3 inputs, 2 outputs)"


@pytest.mark.parametrize(
    "copied", [copy.copy, copy.deepcopy, lambda body: pickle.loads(pickle.dumps(body))]
)
def test_copies_are_read_only_too(copied, body):
    again = copied(body)
    assert again == body
    assert again is not body
    for field in dataclasses.fields(again):
        assert not getattr(again, field.name).flags.writeable, field.name


def test_arrays_are_read_only_and_frozen():
    body = square(w_in=np.ones((4, 1)))
    for field in dataclasses.fields(Body):
        array = getattr(body, field.name)
        with pytest.raises(ValueError, match="read-only"):
            array[0] = array[1]
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(body, field.name, array)


def test_arrays_are_copies():
    k1 = FIVE.copy()
    body = square(k1=k1)
    k1[0] = 99.0
    assert body.k1[0] == 1.0
    assert k1.flags.writeable


def test_equality_sees_the_last_bit_of_every_array():
    full = {"masses": np.ones(4), "w_in": np.ones((4, 1)), "w_fb": np.ones((4, 2)),
            "rest_lengths": FIVE}  # fmt: skip
    body = square(**full)
    assert body == square(**full)
    for name in ("positions", "k1", "k3", "d1", "d3", *full):
        changed = np.array(getattr(body, name))
        changed.flat[-1] = np.nextafter(changed.flat[-1], np.inf)
        assert body != square(**full | {name: changed}), name
    assert body != square(**full | {"fixed": [True, True, False, False]})
    assert body != square(**full | {"springs": [[1, 0], *SQUARE["springs"][1:]]})
    assert body != square(**full | {"w_in": np.ones((4, 2))})
    assert body != "a body"


def test_bodies_are_not_hashable():
    with pytest.raises(TypeError):
        hash(square())


def test_collinear_nodes_make_a_body():
    """Collinear points have no triangulation, but a chain of springs is a body."""
    chain = Body([[0, 0], [1, 1], [2, 2]], [[0, 1], [1, 2]], [1, 1], [0, 0], [1, 1], [0, 0])
    assert chain.fixed.tolist() == [True, False, True]


def test_spring_lengths_over_time():
    positions = np.array([SQUARE["positions"], 2 * np.array(SQUARE["positions"])])
    lengths = spring_lengths(positions, np.array(SQUARE["springs"]))
    assert lengths == pytest.approx(np.outer([1, 2], [3, 4, 4, np.sqrt(17), 5]), rel=1e-15)
