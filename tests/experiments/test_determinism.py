"""Same seed, same bits: whatever the chunks, and however many threads BLAS has."""

import os
import subprocess
import sys

import numpy as np

import mcmj

HASH_OF_A_TAUGHT_RUN = """
import hashlib
import mcmj
body = mcmj.random_body(0, 15)
simulation = mcmj.Simulation(body)
goal = mcmj.target("quadratic")
fit = mcmj.teach(simulation, goal, mcmj.Teaching(duration=20, washout=5), seed=0)
run = simulation.rollout(5000)
data = fit.w_out.tobytes() + run.lengths.tobytes() + run.outputs.tobytes()
print(hashlib.sha256(data).hexdigest())
"""


def test_outputs_do_not_depend_on_chunks():
    body = mcmj.random_body(1, 12)
    w_out = np.random.default_rng(0).standard_normal((body.n_springs, 2))
    forces = np.random.default_rng(1).uniform(-1, 1, body.n_nodes)
    simulation = mcmj.Simulation(body, w_out=1e-3 * w_out)
    whole = simulation.rollout(2000, forces=forces).outputs
    for sizes in ((1, 999, 1000), (1537, 463)):
        simulation.reset()
        parts = [simulation.rollout(n, forces=forces).outputs for n in sizes]
        assert np.array_equal(np.concatenate(parts), whole)


def test_teaching_does_not_depend_on_blas_threads():
    hashes = set()
    for threads in ("1", "2"):
        environment = os.environ | {"OPENBLAS_NUM_THREADS": threads, "OMP_NUM_THREADS": threads}
        done = subprocess.run(
            [sys.executable, "-c", HASH_OF_A_TAUGHT_RUN],
            env=environment, capture_output=True, text=True, check=True,
        )  # fmt: skip
        hashes.add(done.stdout)
    assert len(hashes) == 1
