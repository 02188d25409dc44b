"""Make tests/data/recorded: python tests/support/record.py. A small body under random pushes."""

from dataclasses import replace
from pathlib import Path

import numpy as np

import mcmj
from mcmj.core.random_body import draw_body
from mcmj.experiments.capacity.config import probed_body
from mcmj.simulation.held_symbols import held_states

FOLDER = Path(__file__).parents[1] / "data" / "recorded"


def main():
    sim = mcmj.Simulation(draw_body(1, replace(probed_body(), nodes=6)))
    pushes = np.random.default_rng(0).uniform(-1, 1, (200, 1))
    lengths = held_states(sim, pushes, 100)
    before = np.roll(pushes, 1)
    tables = {
        "signals": (["time [s]", *sim.signal_names], [0.1 * np.arange(200)[:, None], lengths]),
        "inputs": (["input"], [pushes]),
        "targets": (["before", "product"], [before, before * pushes]),
    }
    for name, (columns, parts) in tables.items():
        np.savetxt(
            FOLDER / f"{name}.csv", np.hstack(parts), "%.7g", ",", header=",".join(columns),
            comments="",
        )  # fmt: skip


if __name__ == "__main__":
    main()
