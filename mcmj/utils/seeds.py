"""Independent random streams by purpose: the same seed never feeds two purposes twice."""

import numpy as np

from mcmj.utils.errors import UnknownNameError
from mcmj.utils.validation import require_seed

# the order is part of every result: only append
PURPOSES = (
    "topology",
    "k1",
    "k3",
    "d1",
    "d3",
    "masses",
    "input_weights",
    "feedback_weights",
    "teacher_noise",
    "length_noise",
    "forces",
    "initial_state",
    "schedule_forces",
    "schedule_noise",
    "rest_noise",
    "search_space",
    "search_audit",
    "held_out_noise",
    "pruning_order",
    "task_inputs",
    "probe_inputs",
    "input_search",
    "walk_moments",
    "walk_pushes",
    "channel_gains",
    "kicks",
    "body_design",
    "random_search",
    "practice_push",
)


def stream(seed: int, purpose: str) -> np.random.Generator:
    """The generator of a seed for a purpose, a child of SeedSequence(seed).

    Raises:
        InvalidArgumentError: the seed is not an integer >= 0.
        UnknownNameError: not one of PURPOSES.
    """
    require_seed("seed", seed)
    if purpose not in PURPOSES:
        raise UnknownNameError("random stream", purpose, PURPOSES)
    child = np.random.SeedSequence(seed, spawn_key=(PURPOSES.index(purpose),))
    return np.random.default_rng(child)
