"""Capacities and ranks of systems whose value is known exactly, and of a body."""

import numpy as np
import pytest

import mcmj
from mcmj.core.random_body import draw_body
from mcmj.experiments.capacity import run as experiment
from mcmj.experiments.capacity.config import Config, probed_body
from mcmj.experiments.capacity.run import measure
from mcmj.metrics.capacity import (
    generalisation_rank,
    kernel_rank,
    memory_capacity,
    processing_capacity,
)
from mcmj.simulation.held_symbols import held_states
from mcmj.utils.errors import InvalidArgumentError

CHANCE = 0.05  # of a capacity from noise: 1e-4 of the targets exceed the threshold of 0.01


@pytest.fixture(scope="module")
def inputs():
    return np.random.default_rng(5).uniform(-1.0, 1.0, 4000)


def delay_line(inputs, taps):
    padded = np.concatenate([np.zeros(taps - 1), inputs])
    return np.column_stack([padded[taps - 1 - i : taps - 1 - i + len(inputs)] for i in range(taps)])


def test_a_delay_line_has_one_unit_a_tap(inputs):
    """N taps, mixed: N linear capacities of 1, at delays 0 .. N - 1, and nothing else."""
    mixing = np.random.default_rng(0).normal(size=(8, 8))
    states = 100.0 + delay_line(inputs, 8) @ mixing
    found = memory_capacity(states, inputs, 20)
    assert found.by_delay(1)[:8] == pytest.approx(np.ones(8), abs=1e-10)
    assert found.total == pytest.approx(8.0, abs=CHANCE)
    assert found.rank == 8
    whole = processing_capacity(states, inputs, [20, 8, 4])
    assert whole.of_degree(1) == pytest.approx(8.0, abs=CHANCE)
    assert whole.of_degree(2) + whole.of_degree(3) < CHANCE


def test_a_memoryless_polynomial_has_one_unit_a_power(inputs):
    """States u, u^2, u^3 span P1, P2, P3 of the present input: one unit of each degree."""
    states = np.column_stack([inputs, inputs**2, inputs**3])
    found = processing_capacity(states, inputs, [10, 6, 4])
    for degree in (1, 2, 3):
        assert found.of(((0, degree),)) == pytest.approx(1.0, abs=1e-10)
        assert found.of_degree(degree) == pytest.approx(1.0, abs=CHANCE)


def test_a_product_of_two_inputs_is_one_target(inputs):
    states = np.column_stack([inputs * np.roll(inputs, 3), np.roll(inputs, 1)])
    found = processing_capacity(states, inputs, [6, 6])
    assert found.of(((0, 1), (3, 1))) == pytest.approx(1.0, abs=1e-10)
    assert found.of(((1, 1),)) == pytest.approx(1.0, abs=1e-10)
    assert found.total == pytest.approx(2.0, abs=CHANCE)


def test_half_noise_halves_the_capacity(inputs):
    """u + n, n of the variance of u: C = 1/2, up to a standard error of 1 / sqrt(4000)."""
    noise = np.random.default_rng(1).uniform(-1.0, 1.0, len(inputs))
    found = memory_capacity((inputs + noise)[:, None], inputs, 5)
    assert found.of(((0, 1),)) == pytest.approx(0.5, abs=0.04)


def test_noise_has_no_capacity(inputs):
    """Of 30 noisy states, the threshold lets almost nothing through; without it, 400 x 30 / K."""
    states = np.random.default_rng(2).normal(size=(len(inputs), 30))
    assert processing_capacity(states, inputs, [60, 15, 8]).total < 2 * CHANCE
    assert processing_capacity(states, inputs, [60, 15, 8], p_value=1.0).total > 2.0


def test_the_total_of_a_fading_reservoir_is_its_rank(inputs):
    """x_k = a x_(k-1) + u_k, many a: linear, so the sum is that of degree 1, the rank."""
    rates = np.array([0.1, 0.4, 0.6, 0.8])
    states = np.zeros((len(inputs), 4))
    for k in range(1, len(inputs)):
        states[k] = rates * states[k - 1] + inputs[k]
    found = processing_capacity(states[100:], inputs[100:], [60, 5])
    assert found.rank == 4
    assert found.total == pytest.approx(4.0, abs=0.15)  # a sampled basis is not quite orthogonal


def test_ranks_of_a_delay_line():
    """N taps tell N streams apart; streams that share the last s symbols differ in N - s."""
    rng = np.random.default_rng(3)
    streams = rng.uniform(-1.0, 1.0, (50, 20))
    alike = streams.copy()
    alike[:, -3:] = streams[0, -3:]
    assert kernel_rank(streams[:, -8:], 1e-6) == 8
    assert generalisation_rank(alike[:, -8:], 1e-6) == 5
    assert kernel_rank(streams[:5, -8:], 1e-6) == 4  # about their mean
    assert kernel_rank(1e-7 * streams[:, -8:], 1e-6) == 0


def test_held_states_are_what_the_body_has_at_the_end_of_each_symbol():
    body = draw_body(1, probed_body())
    symbols = np.random.default_rng(4).uniform(-1.0, 1.0, (400, 1))
    states = held_states(mcmj.Simulation(body), symbols, 50)
    lengths = mcmj.Simulation(body).rollout(inputs=np.repeat(symbols, 50, axis=0)).lengths
    assert np.array_equal(states, lengths[49::50])  # over two chunks


def test_a_body_in_mujoco_and_in_the_twin_are_worth_the_same():
    config = Config(streams=20, stream_symbols=12, shared=4, washout=20, max_delays=(15, 5))
    body = draw_body(0, probed_body())
    one, other = (measure(config, body, 1.0, 400, engine=e).measures for e in ("mujoco", "twin"))
    assert one == pytest.approx(other, abs=1e-3)
    assert 1.0 < one["memory_capacity"] < one["ipc_total"] < body.n_springs
    assert one["generalisation_rank"] <= one["kernel_rank"] <= 19


def test_maps_cover_the_grid_and_mark_what_blows_up():
    config = Config(
        symbols=300, washout=20, map_symbols=300, streams=10, stream_symbols=6, shared=2,
        max_delays=(10,), stiffness=(1.0,), damping=(1.0, 10.0), sizes=(5,), strengths=(1.0, 1e7),
    )  # fmt: skip
    maps = experiment.run(config).maps
    assert maps["stiffness_damping"]["ipc_total"].shape == (1, 2)
    assert np.isfinite(maps["stiffness_damping"]["kernel_rank"]).all()
    assert np.isnan(maps["size_strength"]["ipc_total"]).tolist() == [[False, True]]


def test_wrong_arguments(inputs):
    with pytest.raises(InvalidArgumentError, match=r"inputs: expected numbers in \[-1, 1\], got 2"):
        memory_capacity(delay_line(inputs, 3), 2 * inputs / np.abs(inputs).max(), 5)
    with pytest.raises(InvalidArgumentError, match="states: expected more than 11 samples, got 9"):
        memory_capacity(delay_line(inputs, 3)[:9], inputs[:9], 5)
    with pytest.raises(InvalidArgumentError, match="resolution"):
        kernel_rank(delay_line(inputs, 3), 0.0)
    with pytest.raises(InvalidArgumentError, match="term: expected one of the targets"):
        memory_capacity(delay_line(inputs, 3), inputs, 5).of(((9, 1),))
    with pytest.raises(InvalidArgumentError, match="shared: expected fewer than the 5 symbols"):
        Config(stream_symbols=5, shared=5)
