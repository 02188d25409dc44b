"""Simulation and Ensemble: exact solutions, the twin, and what carries over between calls."""

from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
import twins

import mcmj
from mcmj import Body, Ensemble, Simulation
from mcmj.errors import DivergenceError, InvalidArgumentError, McmjError, UnknownNameError
from mcmj.mjcf import INTEGRATORS
from mcmj.simulation import CHUNK

ALL = ("lengths", "outputs", "positions", "velocities")
T = 300
# measured: at most 5e-13 m on lengths up to 80 m
SAME = {"lengths": 3e-12, "outputs": 3e-13, "positions": 3e-12, "velocities": 2e-12}


def assert_same(rollout, twin):
    for name, limit in SAME.items():
        assert np.abs(getattr(rollout, name) - getattr(twin, name)).max() < limit, name


def same_bits(one, other, names=ALL):
    """Everything to the bit; outputs, a BLAS product of the lengths, to its rounding."""
    close = "outputs" not in names or np.abs(one.outputs - other.outputs).max() < 3e-14
    return close and all(
        getattr(one, n).tobytes() == getattr(other, n).tobytes() for n in names if n != "outputs"
    )


@pytest.fixture(scope="module")
def drive(body):
    """Everything that can push, over T steps."""
    rng = np.random.default_rng(3)
    return {
        "inputs": rng.normal(size=(T, body.n_inputs)),
        "offset": rng.normal(size=(T, body.n_outputs)),
        "gate": np.array([1.0, 0.4]),
        "forces": 5 * rng.normal(size=(T, body.n_nodes)),
    }


def join(parts):
    """Consecutive trajectories as one."""
    axis = {"times": 0, "lengths": -2, "outputs": -2, "positions": -3, "velocities": -3}
    return SimpleNamespace(
        **{n: np.concatenate([getattr(p, n) for p in parts], axis=a) for n, a in axis.items()}
    )


def part(drive, start, stop):
    return {n: value if n == "gate" else value[start:stop] for n, value in drive.items()}


# --- exact solutions -------------------------------------------------------------------------


def exact_oscillator(body, times, force=0.0):
    """(x, v) of m x'' = -k x - d x' + force from x = 0.5 at rest."""
    k, d, m = body.k1[0], body.d1[0], body.masses[1]
    decay, start = d / (2 * m), 0.5 - force / k
    w = np.sqrt(k / m - decay**2)
    envelope = start * np.exp(-decay * times)
    x = force / k + envelope * (np.cos(w * times) + decay / w * np.sin(w * times))
    v = -envelope * (w + decay**2 / w) * np.sin(w * times)
    return np.column_stack([x, v])


def oscillator_error(body, integrator, timestep, force=0.0):
    steps = round(2.0 / timestep)
    run = Simulation(body, integrator=integrator, timestep=timestep).rollout(
        steps, forces=[0.0, force], record=("lengths", "positions", "velocities")
    )
    exact = exact_oscillator(body, run.times, force)
    assert np.abs(run.positions[:, 1, 1]).max() == 0.0
    return max(
        np.abs(run.lengths[:, 0] - 1.0 - exact[:, 0]).max(),
        np.abs(run.velocities[:, 1, 0] - exact[:, 1]).max(),
    )


@pytest.mark.parametrize(("integrator", "order"), [("Euler", 1), ("RK4", 4), ("implicit", 1)])
@pytest.mark.parametrize("force", [0.0, 3.0])
def test_oscillator_converges_to_the_exact_solution(oscillator, integrator, order, force):
    steps = [0.04, 0.02, 0.01]
    errors = [oscillator_error(oscillator, integrator, h, force) for h in steps]
    orders = np.log2(errors[:-1]) - np.log2(errors[1:])
    assert orders == pytest.approx([order] * 2, abs=0.12)
    assert errors[-1] < (0.04 if order == 1 else 2e-8)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_oscillator_under_every_integrator(oscillator, integrator):
    assert oscillator_error(oscillator, integrator, 1e-3) < 5e-3


def test_constant_force_ends_in_equilibrium(oscillator):
    """k1 x = F once all has come to rest."""
    simulation = Simulation(oscillator, integrator="RK4", timestep=0.02)
    rest = simulation.rollout(5000, forces=[0.0, 4.5]).lengths[-1]
    assert rest == pytest.approx([1.0 + 4.5 / 9.0], abs=1e-12)


def test_energy_balance():
    """Loss of kinetic and elastic energy = work of the dampers, for the full nonlinear body."""
    body = mcmj.random_body(4, nodes=10, k1=(5.0, 50.0))
    simulation = Simulation(body, integrator="RK4", timestep=1e-4)
    rng = np.random.default_rng(0)
    simulation.set_state(velocities=0.3 * rng.normal(size=(10, 2)))
    run = simulation.rollout(4001, record=("lengths", "positions", "velocities"))
    a, b = body.springs.T
    axis = (run.positions[:, b] - run.positions[:, a]) / run.lengths[..., None]
    rate = ((run.velocities[:, b] - run.velocities[:, a]) * axis).sum(axis=-1)
    x = run.lengths - body.rest_lengths
    elastic = (body.k1 * x**2 / 2 + body.k3 * x**4 / 4).sum(axis=1)
    kinetic = (body.masses[:, None] * run.velocities**2).sum(axis=(1, 2)) / 2
    power = (body.d1 * rate**2 + body.d3 * rate**4).sum(axis=1)
    h = simulation.timestep
    work = h / 3 * (power[0] + 4 * power[1:-1:2].sum() + 2 * power[2:-2:2].sum() + power[-1])
    energy = elastic + kinetic
    assert energy[0] > 1.2 * energy[-1]
    assert energy[0] - energy[-1] == pytest.approx(work, rel=5e-8)
    assert (np.diff(energy) < 0).all()


# --- symmetries ------------------------------------------------------------------------------


def changed(body, **arrays):
    return Body(**{n: getattr(body, n) for n in Body.__dataclass_fields__} | arrays)


@pytest.mark.parametrize("flip", [[1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]])
def test_a_mirrored_body_moves_as_a_mirror_image(body, w_out, drive, flip):
    x = flip[0]
    mirror = changed(body, positions=body.positions * flip, w_in=x * body.w_in, w_fb=x * body.w_fb)
    image = drive | {"forces": x * drive["forces"]}
    run = Simulation(body, w_out=w_out).rollout(**drive, record=ALL)
    seen = Simulation(mirror, w_out=w_out).rollout(**image, record=ALL)
    assert np.abs(run.positions * flip - seen.positions).max() < 1e-12
    assert np.abs(run.lengths - seen.lengths).max() < 1e-12


def test_renumbered_nodes_and_springs_move_the_same(body, w_out, drive):
    rng = np.random.default_rng(0)
    nodes, springs = rng.permutation(body.n_nodes), rng.permutation(body.n_springs)
    per_node = {
        n: getattr(body, n)[nodes] for n in ("positions", "fixed", "w_in", "w_fb", "masses")
    }
    names = ("k1", "k3", "d1", "d3", "rest_lengths")
    per_spring = {n: getattr(body, n)[springs] for n in names}
    other = Body(
        springs=np.argsort(nodes)[body.springs[springs]][:, ::-1], **per_node, **per_spring
    )
    run = Simulation(body, w_out=w_out).rollout(**drive, record=ALL)
    seen = Simulation(other, w_out=w_out[springs]).rollout(
        **drive | {"forces": drive["forces"][:, nodes]}, record=ALL
    )
    assert np.abs(run.positions[:, nodes] - seen.positions).max() < 1e-12
    assert np.abs(run.outputs - seen.outputs).max() < 1e-13


def test_a_body_at_rest_stays_there(body):
    run = Simulation(body).rollout(1000, record=("positions",))
    assert np.abs(run.positions - body.positions).max() < 1e-12


# --- against the twin ------------------------------------------------------------------------


@pytest.mark.parametrize("integrator", ["Euler"])
@pytest.mark.parametrize("delay", [1, 2, 5])
@pytest.mark.parametrize("bias", [False, True])
@pytest.mark.parametrize("substeps", [1, 3])
def test_feedback_delay(body, w_out, w_bias, drive, integrator, delay, bias, substeps):
    """The output fed back at step k is outputs[k - delay], and 0 before there is one."""
    options = {"integrator": integrator, "w_out": w_bias if bias else w_out}
    simulation = Simulation(body, feedback_delay=delay, substeps=substeps, **options)
    run = simulation.rollout(**drive, record=ALL)
    assert_same(run, twins.run(body, T, delay=delay, substeps=substeps, **options, **drive))


def test_feedback_delay_is_refused_where_it_would_be_wrong(body):
    """MuJoCo's delayed sensors remember RK4's inner stages."""
    with pytest.raises(InvalidArgumentError, match="feedback_delay: expected 0 under RK4"):
        Simulation(body, integrator="RK4", feedback_delay=1)


@pytest.mark.parametrize("integrator", [name for name in INTEGRATORS if name != "RK4"])
def test_feedback_delay_under_every_integrator(body, w_out, integrator):
    """Replayed as offsets, the outputs shifted by the delay give the same motion."""
    late = Simulation(body, w_out=w_out, integrator=integrator, feedback_delay=2)
    run = late.rollout(T, record=ALL)
    fed = np.vstack([np.zeros((2, body.n_outputs)), run.outputs[:-2]])
    replay = Simulation(body, integrator=integrator).rollout(offset=fed, record=ALL)
    assert np.abs(run.velocities).max() > 0.01
    assert np.abs(run.lengths - replay.lengths).max() < 2e-13


@pytest.mark.parametrize("timestep", [7e-4, 1 / 300])
def test_delay_and_hold_do_not_drift_over_many_steps(oscillator, timestep):
    """Sensors know time as a sum of steps; its rounding must not shift a sample."""
    body = changed(oscillator, w_fb=[[0.0], [1.0]])
    w_out, steps = np.array([[0.8]]), 30_000
    forces = np.column_stack([np.zeros(steps), 30 * np.sin(0.05 * np.arange(steps))])
    late = Simulation(body, w_out=w_out, timestep=timestep, feedback_delay=3, substeps=3)
    run = late.rollout(forces=forces)
    fed = np.vstack([np.zeros((3, 1)), run.outputs[:-3]])
    replay = Simulation(body, timestep=timestep, substeps=3).rollout(offset=fed, forces=forces)
    assert np.ptp(run.lengths[-1000:]) > 0.01
    assert np.abs(run.lengths - replay.lengths).max() < 1e-13


@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
@pytest.mark.parametrize("substeps", [2, 5])
def test_substeps_hold_everything(body, w_bias, drive, integrator, substeps):
    options = {"w_out": w_bias, "integrator": integrator, "substeps": substeps, "timestep": 2e-3}
    run = Simulation(body, **options).rollout(**drive, record=ALL)
    assert_same(run, twins.run(body, T, **options, **drive))


@pytest.mark.parametrize("names", [("inputs",), ("offset",), ("forces",), ("inputs", "forces")])
def test_each_drive_alone(body, drive, names):
    some = {name: drive[name] for name in names}
    run = Simulation(body).rollout(**some, record=ALL)
    assert np.abs(run.velocities).max() > 0.01
    assert_same(run, twins.run(body, T, **some))


def test_gate_defaults_to_one_with_a_readout_and_zero_without(body, w_out):
    closed = Simulation(body, w_out=w_out).rollout(50).lengths
    assert closed.tobytes() == Simulation(body, w_out=w_out).rollout(50, gate=1.0).lengths.tobytes()
    opened = Simulation(body, w_out=w_out).rollout(50, gate=0.0)
    assert opened.lengths.tobytes() == Simulation(body).rollout(50).lengths.tobytes()
    assert np.abs(opened.outputs).max() > 0.1  # the readout still reads
    assert not np.array_equal(closed, opened.lengths)


def test_constant_forces_equal_the_same_over_time(body):
    forces = np.linspace(-3, 3, body.n_nodes)
    constant = Simulation(body).rollout(100, forces=forces, record=ALL)
    one_row = Simulation(body).rollout(100, forces=forces[None], record=ALL)
    varying = Simulation(body).rollout(forces=np.tile(forces, (100, 1)), record=ALL)
    assert same_bits(constant, varying)
    assert same_bits(constant, one_row)
    assert_same(constant, twins.run(body, 100, forces=forces))


def test_nothing_that_pushed_pushes_in_the_next_rollout(body, drive):
    simulation = Simulation(body)
    simulation.rollout(**drive)
    simulation.rollout(10, forces=np.ones(body.n_nodes))
    state = simulation.state
    run = simulation.rollout(100, record=ALL)
    twin = twins.run(body, 100, positions=state.positions, velocities=state.velocities)
    assert_same(run, twin)


def test_outputs_are_the_readout_of_the_lengths(body, w_bias, w_out):
    run = Simulation(body, w_out=w_bias).rollout(50)
    assert run.outputs == pytest.approx(run.lengths @ w_bias[:-1] + w_bias[-1], rel=1e-13)
    simulation = Simulation(body)
    assert not simulation.rollout(5).outputs.any()
    simulation.set_readout(w_out)
    run = simulation.rollout(50)
    assert run.outputs == pytest.approx(run.lengths @ w_out, rel=1e-13)
    simulation.set_readout(None)
    assert simulation.w_out is None
    assert not simulation.rollout(5).outputs.any()


# --- hook ------------------------------------------------------------------------------------


def test_hook_equals_the_same_forces_given_in_advance(body, w_bias, drive):
    steps = 60
    forces = np.random.default_rng(5).normal(size=(steps, body.n_nodes))
    shorter = part(drive, 0, steps)
    seen = []

    def hook(time, lengths):
        seen.append((time, lengths))
        return forces[len(seen) - 1]

    run = Simulation(body, w_out=w_bias).rollout(**shorter, hook=hook, record=ALL)
    shorter["forces"] = shorter["forces"] + forces
    wanted = Simulation(body, w_out=w_bias).rollout(**shorter, record=ALL)
    assert same_bits(run, wanted)
    assert [time for time, _ in seen] == pytest.approx(list(run.times), abs=1e-15)
    assert np.abs(np.array([lengths for _, lengths in seen]) - run.lengths).max() < 1e-13


@pytest.mark.parametrize("options", [{}, {"substeps": 3}, {"integrator": "RK4"}])
def test_hook_can_be_a_spring_of_its_own(oscillator, options):
    """A hook that pulls by -k (l - l0) equals a stiffer spring, held over the control step."""

    def hook(time, lengths):
        return [0.0, -4.0 * (lengths[0] - 1.0)]

    run = Simulation(oscillator, timestep=1e-2, **options).rollout(200, hook=hook)
    feedback = changed(oscillator, w_fb=[[0.0], [-4.0]])
    wanted = Simulation(feedback, w_out=[[1.0], [-1.0]], timestep=1e-2, **options).rollout(200)
    assert np.abs(run.lengths - wanted.lengths).max() < 1e-14
    assert np.ptp(run.lengths) > 0.5


def test_hook_must_return_a_force_per_node(body):
    with pytest.raises(InvalidArgumentError) as caught:
        Simulation(body).rollout(3, hook=lambda time, lengths: [1.0, 2.0])
    assert str(caught.value) == "hook's forces: expected shape (8), got shape (2,)"


# --- state -----------------------------------------------------------------------------------

VARIANTS = [
    {},
    {"integrator": "RK4"},
    {"integrator": "discrete"},
    {"feedback_delay": 2},
    {"substeps": 3},
    {"substeps": 3, "feedback_delay": 1},
    {"springs": "cubic"},
]


@pytest.mark.parametrize("options", VARIANTS)
def test_two_rollouts_equal_one(body, w_bias, drive, options):
    whole = Simulation(body, w_out=w_bias, **options).rollout(**drive, record=ALL)
    simulation = Simulation(body, w_out=w_bias, **options)
    parts = [simulation.rollout(**part(drive, a, b), record=ALL) for a, b in ((0, 113), (113, T))]
    assert same_bits(join(parts), whole, (*ALL, "times"))
    assert np.array_equal(parts[-1].final_state.positions, whole.final_state.positions)
    assert simulation.time == pytest.approx(T * 1e-3, abs=1e-15)


@pytest.mark.parametrize("options", VARIANTS)
def test_snapshot_and_restore(body, w_bias, drive, options):
    simulation = Simulation(body, w_out=w_bias, **options)
    simulation.rollout(**part(drive, 0, 57))
    snapshot = simulation.snapshot()
    first = simulation.rollout(**part(drive, 57, T), record=ALL)
    simulation.restore(snapshot)
    again = simulation.rollout(**part(drive, 57, T), record=ALL)
    assert same_bits(first, again, (*ALL, "times"))
    twin = Simulation(body, w_out=w_bias, **options)
    twin.restore(snapshot)
    assert same_bits(first, twin.rollout(**part(drive, 57, T), record=ALL), (*ALL, "times"))


@pytest.mark.parametrize("options", VARIANTS)
def test_reset_is_a_new_start(body, w_bias, drive, options):
    simulation = Simulation(body, w_out=w_bias, **options)
    first = simulation.rollout(**drive, record=ALL)
    simulation.reset()
    assert simulation.time == 0.0
    assert np.array_equal(simulation.state.positions, body.positions)
    assert not simulation.state.velocities.any()
    assert same_bits(first, simulation.rollout(**drive, record=ALL), (*ALL, "times"))


def test_set_state(body):
    rng = np.random.default_rng(0)
    positions = body.positions + rng.normal(size=body.positions.shape)
    velocities = 0.3 * rng.normal(size=body.positions.shape)
    simulation = Simulation(body)
    simulation.set_state(positions, velocities)
    start = np.where(body.fixed[:, None], body.positions, positions)
    assert np.abs(simulation.state.positions - start).max() < 1e-13
    assert np.array_equal(simulation.state.velocities[body.free], velocities[body.free])
    assert not simulation.state.velocities[body.fixed].any()
    twin = twins.run(body, 100, positions=start, velocities=velocities)
    assert_same(simulation.rollout(100, record=ALL), twin)


@pytest.mark.parametrize("chunk", [1, 7, 100, T, 10 * T])
@pytest.mark.parametrize("options", [{}, {"substeps": 3, "feedback_delay": 1}])
def test_chunks_equal_one_rollout(body, w_bias, drive, chunk, options):
    whole = Simulation(body, w_out=w_bias, **options).rollout(**drive, record=ALL)
    chunks = list(
        Simulation(body, w_out=w_bias, **options).stream(**drive, record=ALL, chunk=chunk)
    )
    assert [len(c) for c in chunks[:-1]] == [chunk] * (len(chunks) - 1)
    assert same_bits(join(chunks), whole, (*ALL, "times"))


def test_rollout_longer_than_a_chunk(oscillator):
    steps = CHUNK + 10
    run = Simulation(oscillator).rollout(steps, record=("lengths",))
    assert run.lengths.shape == (steps, 1)
    exact = exact_oscillator(oscillator, run.times[::500])[:, 0]
    assert np.abs(run.lengths[::500, 0] - 1.0 - exact).max() < 2e-3


# --- records ---------------------------------------------------------------------------------


@pytest.mark.parametrize("record", [(), *[(n,) for n in ALL], ("outputs", "positions"), ALL])
def test_only_what_is_asked_for_is_recorded(body, w_out, record):
    run = Simulation(body, w_out=w_out).rollout(10, record=record)
    everything = Simulation(body, w_out=w_out).rollout(10, record=ALL)
    for name in ALL:
        if name in record:
            assert run.get(name).tobytes() == everything.get(name).tobytes()
        else:
            assert getattr(run, name) is None
            with pytest.raises(UnknownNameError):
                run.get(name)
    assert np.array_equal(run.times, 1e-3 * np.arange(10))


def test_unknown_record_lists_the_names(body):
    with pytest.raises(UnknownNameError) as caught:
        Simulation(body).rollout(3, record=("forces",))
    assert caught.value.choices == sorted(ALL)


# --- divergence ------------------------------------------------------------------------------


@pytest.fixture
def explosive():
    """Stiff dampers under explicit Euler: blows up as soon as something moves."""
    return mcmj.random_body(1, nodes=6, d3=(1e5, 1e5))


@pytest.mark.filterwarnings("ignore")  # a warning beforehand is welcome
@pytest.mark.parametrize("with_hook", [False, True])
def test_divergence_says_when_where_and_what_to_try(
    explosive, tmp_path, monkeypatch, capfd, with_hook
):
    monkeypatch.chdir(tmp_path)
    simulation = Simulation(explosive, timestep=5e-3)
    options = {"hook": lambda time, lengths: np.zeros(6)} if with_hook else {}
    with pytest.raises(DivergenceError) as caught:
        simulation.rollout(2000, forces=np.full(6, 1000.0), **options)
    error = caught.value
    assert isinstance(error, ArithmeticError)
    assert isinstance(error, McmjError)
    for text in (
        f"t = {error.time:.6g} s",
        "node ",
        "Euler",
        "step 5 ms",
        "substeps=2",
        "discrete",
    ):
        assert text in str(error)
    assert 0 < error.time < 1.0
    assert error.time == pytest.approx(5e-3 * error.steps_done, abs=5.1e-3)
    assert capfd.readouterr() == ("", "")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.filterwarnings("ignore")
def test_divergence_after_many_steps_counts_them_all(explosive):
    """steps_done is of the rollout, not of the last chunk."""
    calm = CHUNK + 500
    forces = np.zeros((calm + 200, 6))
    forces[calm:] = 1000.0
    with pytest.raises(DivergenceError) as caught:
        Simulation(explosive, timestep=5e-3).rollout(forces=forces)
    assert caught.value.steps_done == pytest.approx(calm, abs=50)
    assert caught.value.time == pytest.approx(5e-3 * calm, abs=0.25)


@pytest.mark.filterwarnings("ignore")
def test_the_remedies_work(explosive):
    forces = np.full(6, 20.0)
    with pytest.raises(DivergenceError):
        Simulation(explosive, timestep=5e-3).rollout(2000, forces=forces)
    good = Simulation(explosive, timestep=5e-3, integrator="discrete").rollout(400, forces=forces)
    assert np.isfinite(good.lengths).all()


@pytest.mark.filterwarnings("ignore")
def test_a_simulation_can_be_reset_after_divergence(explosive):
    simulation = Simulation(explosive, timestep=5e-3)
    with pytest.raises(DivergenceError):
        simulation.rollout(2000, forces=np.full(6, 1000.0))
    simulation.reset()
    assert simulation.time == 0.0
    run = simulation.rollout(100, record=ALL)
    assert same_bits(run, Simulation(explosive, timestep=5e-3).rollout(100, record=ALL))


@pytest.mark.filterwarnings("ignore")
def test_divergence_in_an_ensemble_names_the_copy(explosive):
    forces = np.zeros((3, 300, 6))
    forces[1] = 1000.0
    with pytest.raises(DivergenceError, match=r"^copy 1: ") as caught:
        Ensemble(explosive, copies=3, threads=2, timestep=5e-3).rollout(forces=forces)
    assert caught.value.time < 1.0


def test_our_silence_ends_with_the_rollout(body):
    heard = []
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(heard.append)
    try:
        Simulation(body).rollout(3)
        model = mujoco.MjModel.from_xml_string(mcmj.to_mjcf(body))
        data = mujoco.MjData(model)
        data.qpos[0] = np.nan
        mujoco.mj_step(model, data)
    finally:
        mujoco.set_mju_user_warning(before)
    assert "QPOS" in heard[0]


# --- refused ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"inputs": np.zeros((5, 3))}, "inputs: expected shape (any, 2), got shape (5, 3)"),
        ({"inputs": np.zeros(5)}, "inputs: expected shape (any, 2), got shape (5,)"),
        ({"offset": np.zeros((5, 1))}, "offset: expected shape (any, 2), got shape (5, 1)"),
        ({"offset": [[np.nan, 0]]}, "offset: expected finite numbers, got nan at index (0, 0)"),
        ({"steps": 5, "forces": np.zeros(3)}, "forces: expected shape (8), got shape (3,)"),
        ({"forces": np.zeros((5, 3))}, "forces: expected shape (any, 8), got shape (5, 3)"),
        ({"steps": 5, "gate": [1, 1, 1]}, "gate: expected shape (2), got shape (3,)"),
        ({"steps": 4, "inputs": np.zeros((5, 2))}, "inputs: expected 4 rows, one a step, got 5"),
        (
            {"inputs": np.zeros((5, 2)), "offset": np.zeros((6, 2))},
            "offset: expected 5 rows, one a step, got 6",
        ),
        ({"steps": 5, "forces": np.zeros((2, 8))}, "forces: expected 5 rows, one a step, got 2"),
        ({"steps": -1}, "steps: expected an integer >= 1, got -1"),
        ({"steps": 2.5}, "steps: expected an integer >= 1, got 2.5"),
        (
            {},
            "steps: expected a number of steps, or inputs, offset or forces over time, got None",
        ),
    ],
)
def test_wrong_drives_are_named(body, options, text):
    with pytest.raises(InvalidArgumentError) as caught:
        Simulation(body).rollout(**options)
    assert str(caught.value) == text


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("timestep", 0.0),
        ("timestep", -1e-3),
        ("timestep", np.inf),
        ("feedback_delay", -1),
        ("feedback_delay", 0.5),
        ("substeps", 0),
        ("substeps", 1.0),
        ("w_out", np.zeros((3, 2))),
    ],
)
def test_wrong_settings_are_named(body, name, value):
    with pytest.raises(InvalidArgumentError) as caught:
        Simulation(body, **{name: value})
    assert caught.value.name == name


def test_wrong_state_and_snapshot_are_named(body):
    simulation = Simulation(body)
    with pytest.raises(InvalidArgumentError, match=r"^velocities: expected shape \(8, 2\)"):
        simulation.set_state(velocities=np.zeros((7, 2)))
    with pytest.raises(InvalidArgumentError, match=r"^snapshot: "):
        simulation.restore(np.zeros((1, 3)))
    with pytest.raises(InvalidArgumentError, match=r"^chunk: "):
        simulation.stream(5, chunk=0)


def test_unknown_integrator_lists_the_names(body):
    with pytest.raises(UnknownNameError) as caught:
        Simulation(body, integrator="euler")
    assert caught.value.choices == sorted(INTEGRATORS)


# --- ensembles -------------------------------------------------------------------------------


@pytest.mark.parametrize("options", VARIANTS)
def test_ensemble_equals_simulation_on_one_and_two_threads(body, w_bias, drive, options):
    alone = Simulation(body, w_out=w_bias, **options).rollout(**drive, record=ALL)
    for threads in (1, 2):
        together = Ensemble(body, copies=5, threads=threads, w_out=w_bias, **options).rollout(
            **drive, record=ALL
        )
        for copy in range(5):
            one = SimpleNamespace(**{name: together.get(name)[copy] for name in ALL})
            assert same_bits(one, alone), threads


@pytest.mark.parametrize("bias", [False, True])
def test_every_copy_has_its_own_readout_and_drive(body, bias):
    rng = np.random.default_rng(9)
    copies, steps = 4, 80
    readouts = 0.05 * rng.normal(size=(copies, body.n_springs + bias, 2))
    inputs, forces = rng.normal(size=(copies, steps, 2)), rng.normal(size=(copies, steps, 8))
    offset, velocities = rng.normal(size=(steps, 2)), 0.2 * rng.normal(size=(copies, 8, 2))
    ensemble = Ensemble(body, copies=copies, threads=2, w_out=readouts)
    ensemble.set_state(velocities=velocities)
    run = ensemble.rollout(inputs=inputs, forces=forces, offset=offset, record=ALL)
    assert run.lengths.shape == (copies, steps, body.n_springs)
    for c in range(copies):
        twin = twins.run(
            body,
            steps,
            w_out=readouts[c],
            inputs=inputs[c],
            forces=forces[c],
            offset=offset,
            velocities=velocities[c],
        )
        for name, limit in SAME.items():
            assert np.abs(run.get(name)[c] - getattr(twin, name)).max() < limit, name
    end = ensemble.state
    assert end.positions.shape == end.velocities.shape == (copies, 8, 2)


def test_ensemble_snapshot_and_chunks(body, w_bias, drive):
    ensemble = Ensemble(body, copies=3, threads=2, w_out=w_bias, feedback_delay=1)
    ensemble.set_state(velocities=np.random.default_rng(0).normal(size=(3, 8, 2)))
    snapshot = ensemble.snapshot()
    whole = ensemble.rollout(**drive, record=ALL)
    ensemble.restore(snapshot)
    chunks = list(ensemble.stream(**drive, record=ALL, chunk=41))
    assert same_bits(join(chunks), whole)


def test_ensemble_hook_beside_forces_of_every_copy(body):
    forces = np.random.default_rng(0).normal(size=(2, 5, 8))
    push = np.linspace(-1, 1, 8)
    run = Ensemble(body, copies=2).rollout(
        forces=forces, hook=lambda time, lengths: push, record=ALL
    )
    wanted = Ensemble(body, copies=2).rollout(forces=forces + push, record=ALL)
    assert same_bits(run, wanted)


@pytest.mark.parametrize(
    ("name", "value"),
    [("copies", 0), ("threads", 0), ("copies", 1.5), ("w_out", np.zeros((2, 16, 2)))],
)
def test_wrong_ensembles_are_named(body, name, value):
    with pytest.raises(InvalidArgumentError) as caught:
        Ensemble(body, **{"copies": 3, name: value})
    assert caught.value.name == name
