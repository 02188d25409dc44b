import numpy as np
import pytest
from hypothesis import settings
from rollouts import T

import mcmj
from mcmj.analysis.stability.cycle import find_cycle
from mcmj.analysis.stability.loop import ClosedLoop

# compiling models takes milliseconds to seconds; every run tries the same examples
settings.register_profile("mcmj", deadline=None, max_examples=40, derandomize=True)
settings.load_profile("mcmj")


@pytest.fixture(scope="session")
def body():
    """8 nodes with unequal masses, 2 inputs, 2 outputs, weights on a fixed node too."""
    drawn = mcmj.random_body(1, nodes=8, n_inputs=2, masses=(0.5, 2.0))
    arrays = {name: getattr(drawn, name) for name in drawn.__dataclass_fields__}
    w_fb, w_in = drawn.w_fb.copy(), drawn.w_in.copy()
    w_fb[drawn.fixed], w_in[drawn.fixed] = 3.0, -2.0
    return mcmj.Body(**arrays | {"w_fb": w_fb, "w_in": w_in})


@pytest.fixture(scope="session")
def w_out(body):
    """A readout that keeps the small body busy and bounded."""
    return 0.05 * np.random.default_rng(0).normal(size=(body.n_springs, body.n_outputs))


@pytest.fixture(scope="session")
def w_bias(w_out):
    """The same with a bias row."""
    return np.vstack([w_out, [[0.7, -0.4]]])


@pytest.fixture(scope="session")
def oscillator():
    """One mass on one linear spring along x, pulled out by 0.5 m: m x'' = -k x - d x'."""
    return mcmj.Body(
        positions=[[0.0, 0.0], [1.5, 0.0]],
        springs=[[0, 1]],
        k1=[9.0],
        k3=[0.0],
        d1=[0.8],
        d3=[0.0],
        rest_lengths=[1.0],
        fixed=[True, False],
        masses=[1.0, 2.0],
    )


@pytest.fixture(scope="session")
def taught_loop():
    """A body taught Van der Pol as a closed loop, its cycle, and the target."""
    body, goal = mcmj.random_body(seed=0), mcmj.target("van_der_pol")
    simulation = mcmj.Simulation(body)
    fit = mcmj.teach(simulation, goal, mcmj.Teaching(duration=60.0), 0)
    loop = ClosedLoop(body, fit.w_out)
    cycle = find_cycle(loop, loop.vector(simulation.state), goal.period, settle=60.0)
    return loop, cycle, goal


@pytest.fixture(scope="session")
def drive(body):
    """Everything that can push, over T steps."""
    rng = np.random.default_rng(3)
    return {
        "inputs": rng.normal(size=(T, body.n_inputs)),
        "offset": rng.normal(size=(T, body.n_outputs)),
        "gate": np.array([1.0, 0.4]),
        "forces": 5 * rng.normal(size=(T, body.n_nodes)),
    }
