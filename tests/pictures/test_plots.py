"""Figures in one line show what they were given."""

import numpy as np
import pytest

import mcmj
from mcmj.core.trajectory import Trajectory
from mcmj.utils.errors import InvalidArgumentError

TARGET = mcmj.target("van_der_pol")


def test_a_body_has_its_springs_and_nodes():
    body = mcmj.random_body(seed=1, nodes=12)
    (axes,) = mcmj.plot_body(body).axes
    assert len(axes.collections[0].get_segments()) == body.n_springs
    assert len(axes.lines) == body.n_nodes


def test_a_run_lies_on_its_target_whatever_its_phase():
    times = 1e-2 * np.arange(2000)
    run = Trajectory(times, outputs=TARGET.sample(times + 1.234))
    over_time, plane = mcmj.plot_run(run, TARGET).axes
    wanted, output = (line.get_ydata() for line in over_time.lines[:2])
    assert np.abs(wanted - output).max() < 0.05  # the phase is found to 1/400 of a period
    assert over_time.get_xlabel() == "time [s]"
    np.testing.assert_array_equal(plane.lines[-1].get_xdata(), run.outputs[:, 0])


def test_a_run_of_another_target_is_refused():
    run = Trajectory(np.arange(10.0), outputs=np.zeros((10, 4)))
    with pytest.raises(InvalidArgumentError, match=r"run: expected outputs \(T, 2\)"):
        mcmj.plot_run(run, TARGET)
