"""Watch a body at work in MuJoCo's viewer, its loop closed, and disturb it.

Drag a node with the mouse (double click selects, Ctrl + Shift + right button drags) and watch the
rhythm recover. Keys: 6, 7 freeze output x1, x2; 8 kicks all nodes; 9 takes the next readout;
0 starts again. Needs a screen.
"""

from pathlib import Path

from rich.console import Console

from mcmj import store
from mcmj.cli import Output, main
from mcmj.experiments.view import Config, run


def work(config: Config, output: Output, out: Path) -> None:
    result = run(config)
    arrays = {"times": result.times, "outputs": result.outputs}
    store.write_arrays(out / "trajectory.npz", arrays, config, config.seed)
    store.write_metrics(out / "metrics.json", "view", config, config.seed, result.metrics)
    if not output.quiet:
        metrics = result.metrics
        Console().print(
            f"{metrics['frames']} frames, {metrics['frames_per_second']:.0f} a second, "
            f"{metrics['real_time_factor']:.2f} x real time; in {out}"
        )


if __name__ == "__main__":
    main("view", Config, work)
