"""Seeded mutations of body files: python tests/support/fuzz_body_files.py --seconds 60 [--seed 0]

Batches run in processes of their own: a crash or a hang names the seed that repeats it.
"""

import argparse
import faulthandler
import re
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import replace

import numpy as np

BATCH, HANG = 50, 20
LAWS = ("native", "leapfrog", "cubic", "tansig", "coupled")
VALUES = ("0", "-1", "nan", "inf", "1e308", "5e-324", "0x1p-1074", "5e8", "9" * 5000, "", "a", "é")
TAGS = ("include", "replicate", "composite", "geom", "joint", "size", "key", "equality", "plugin")


def mutated(text: str, rng: np.random.Generator) -> str:
    """One to four changes: a value, a tag, a line lost, doubled or moved, bytes."""
    for _ in range(rng.integers(1, 5)):
        kind = rng.integers(5)
        if kind == 0:
            values = list(re.finditer(r'"([^"]*)"', text))
            at = values[rng.integers(len(values))] if values else re.match("", text)
            text = f'{text[: at.start()]}"{rng.choice(VALUES)}"{text[at.end() :]}'
        elif kind == 1:
            words = list(re.finditer(r"-?\d[\d.e+-]*", text))
            at = words[rng.integers(len(words))] if words else re.match("", text)
            text = text[: at.start()] + str(rng.choice(VALUES)) + text[at.end() :]
        elif kind == 2:
            lines = text.split("\n")
            i, j = rng.integers(len(lines), size=2)
            lines[i : i + 1] = [[], [lines[i]] * 2, [lines[i], lines[j]]][rng.integers(3)]
            text = "\n".join(lines)
        elif kind == 3:
            lines = text.split("\n")
            tag = f'<{rng.choice(TAGS)} count="5" name="n0" file="x"/>'
            lines.insert(rng.integers(len(lines)), tag)
            text = "\n".join(lines)
        else:
            i = rng.integers(len(text) + 1)
            text = text[:i] + chr(rng.integers(1, 256)) + text[i + rng.integers(3) :]
    return text


def batch(seed: int) -> None:
    """Mutations `seed` to `seed + BATCH`: stepped as they are and as the Body that they hold."""
    import mujoco

    import mcmj
    from mcmj.core.callbacks import install
    from mcmj.core.callbacks.coupled_laws import CoupledLaw
    from mcmj.mjcf.read import load_model
    from mcmj.utils.errors import McmjError
    from mcmj.utils.quiet import quiet_warnings

    install.install(passive=True)
    coupled = CoupledLaw("all_springs", _all_springs)
    for i in range(seed, seed + BATCH):
        print(i, flush=True)
        faulthandler.dump_traceback_later(HANG, exit=True)
        rng = np.random.default_rng(i)
        law = LAWS[i % len(LAWS)]
        body = mcmj.random_body(i, 5, depth=50.0 * (i // len(LAWS) % 2))
        if i % 3 == 0:
            body = replace(body, direction=rng.normal(size=body.dimensions))
        how = {"integrator": "leapfrog"} if law == "leapfrog" else {"springs": law}
        if law == "coupled":
            how = {"springs": coupled}
        w_out = rng.normal(size=(body.n_springs + 1, body.n_outputs))
        text = mutated(mcmj.to_mjcf(body, w_out=w_out, **how), rng)
        with np.errstate(all="ignore"), quiet_warnings():
            try:
                model = load_model(text)
                with suppress(mujoco.FatalError):  # MuJoCo's own limits
                    mujoco.mj_step(model, mujoco.MjData(model), 5)
                read, _w_out = mcmj.from_mjcf(text)
                mcmj.Simulation(read, timestep=1e-3, **how).rollout(5)
            except McmjError as error:
                if "\n" in str(error):
                    raise RuntimeError("expected one line") from error


def _all_springs(x1, x2, parameters, out):
    for j in range(out.size):
        out[j] = parameters[j, 0] * x1[j] + parameters[j, 2] * x2[j]


def run_batch(seed: int) -> None:
    """A batch in a child process.

    Raises:
        AssertionError: it crashed, hung, or raised what is not ours.
    """
    command = [sys.executable, __file__, "--batch", str(seed)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    except subprocess.TimeoutExpired as error:
        raise AssertionError(f"batch {seed} hung after {error.stdout!r}"[-300:]) from error
    last = (done.stdout.split() or [seed])[-1]
    assert done.returncode == 0, f"mutation {last}: rc {done.returncode}\n{done.stderr[-1500:]}"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--batch", type=int)
    given = parser.parse_args()
    if given.batch is not None:
        batch(given.batch)
    else:
        seed, end = given.seed, time.monotonic() + given.seconds
        while time.monotonic() < end:
            run_batch(seed)
            seed += BATCH
        print(f"{seed - given.seed} mutations: no crash, no hang, only our errors")
