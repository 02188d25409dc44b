"""What the benchmark measures of whole processes, start-up and memory, and the machine."""

import os
import platform
import subprocess
import sys
from functools import partial

import numpy as np

from mcmj.core.body import Body
from mcmj.experiments.benchmark.config import READOUT_SIZE, Config
from mcmj.utils.timing import interleaved_seconds


def machine() -> dict[str, object]:
    """What it ran on, and how busy that was."""
    return {
        "platform": platform.platform(),
        "processor": _processor_name(),
        "cores": os.cpu_count(),
        "load_average_1min": os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
    }


def start_up(config: Config, body: Body) -> dict[str, object]:
    """Seconds to import, and to import and install the callbacks from Numba's cache."""
    snippets = {
        "import_seconds": "import mcmj",
        "import_and_callbacks_seconds": "from mcmj.core.callbacks import install\n"
        "install.install(passive=True, sensors=True)",
    }
    seconds = interleaved_seconds(
        {
            name: partial(subprocess.run, [sys.executable, "-c", code], check=True)
            for name, code in {"empty": "pass", **snippets}.items()
        },
        repeats=3,
    )
    empty = float(np.median(seconds["empty"]))
    return {name: float(np.median(seconds[name])) - empty for name in snippets}


def memory(config: Config, body: Body) -> dict[str, object]:
    """Peak resident memory of a process that streams a long closed-loop run, in MB; on Linux."""
    if config.memory_steps == 0 or sys.platform != "linux":
        return {"million_step_peak_mb": None}
    code = (
        "import numpy as np, mcmj\n"
        f"body = mcmj.random_body({config.seed}, {config.nodes})\n"
        f"sim = mcmj.Simulation(body, w_out=np.full((body.n_springs, 2), {READOUT_SIZE}))\n"
        f"n = sum(len(c.lengths) for c in sim.stream({config.memory_steps}))\n"
        f"assert n == {config.memory_steps}\n"
        # not ru_maxrss, which counts the parent's memory at the fork
        "print(next(int(x.split()[1]) for x in open('/proc/self/status') if 'VmHWM' in x) / 1024)"
    )
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    return {"million_step_peak_mb": float(done.stdout)}


def _processor_name() -> str:
    try:
        with open("/proc/cpuinfo") as file:
            names = [line.split(":", 1)[1].strip() for line in file if "model name" in line]
        return names[0] if names else platform.processor()
    except OSError:
        return platform.processor()
