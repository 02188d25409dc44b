"""A soft robot: does it learn to walk, what steers it, and what does it take?"""

from functools import partial

from mcmj.experiments.soft_robot.config import Config
from mcmj.experiments.soft_robot.parts import RUNS
from mcmj.experiments.soft_robot.result import Result, gait_table
from mcmj.experiments.soft_robot.steer import SteeredRobot, learn_steered
from mcmj.experiments.trunk.result import Table
from mcmj.experiments.trunk.run import learn
from mcmj.robots.steering import LOWEST
from mcmj.utils.progress import OnSteps
from mcmj.utils.threads import in_threads


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Let every robot learn every gait and walk, then run the parts with the first one.

    Raises:
        McmjError: a config that MuJoCo does not take.
    """
    seeds = range(config.seed, config.seed + config.seeds)
    chosen = [(seed, name) for seed in seeds for name in config.gaits]
    found = dict(zip(chosen, in_threads(partial(learn, config), chosen, on_steps), strict=True))
    table: Table = {
        name: gait_table(config, [found[seed, name] for seed in seeds]) for name in config.gaits
    }
    gaits = {name: found[config.seed, name] for name in config.gaits}
    good = {name: gait for name, gait in gaits.items() if gait.learned is not None}
    for part in config.parts:
        if part in RUNS:
            rows = in_threads(partial(RUNS[part], config, good), tuple(good), on_steps)
            table[part] = SUMMARIES.get(part, _as_it_is)(config, dict(zip(good, rows, strict=True)))
    return Result(config, gaits, _steer(config, table, on_steps), table)


def _steer(config: Config, table: Table, on_steps: OnSteps) -> dict[str, SteeredRobot]:
    """By kind of input, the first robot; all are in the table."""
    steers = [steer for steer in LOWEST if steer in config.parts]
    seeds = range(config.seed, config.seed + config.seeds)
    chosen = [(seed, steer) for steer in steers for seed in seeds]
    rows = in_threads(partial(learn_steered, config), chosen, on_steps)
    found = dict(zip(chosen, rows, strict=True))
    for steer in steers:
        first = found[config.seed, steer].table
        robots = [found[seed, steer].table for seed in seeds]
        name = "steer" if steer == "turn" else steer
        table[name] = first | _ends(steer, first) | {"robots": robots}
    return {steer: found[config.seed, steer] for steer in steers}


def _ends(steer: str, table: Table) -> Table:
    """At the largest inputs."""
    if table["falls"]:
        return {}
    if steer == "turn":
        turns: list[float] = table["turns_deg_s"]  # type: ignore[assignment]
        return {"left_deg_s": turns[-1], "right_deg_s": turns[0]}
    speeds: list[float] = table["speeds_m_s"]  # type: ignore[assignment]
    return {"fast_m_s": speeds[0], "slow_m_s": speeds[-1]}


def _as_it_is(config: Config, rows: Table) -> Table:
    return rows


def _switches(config: Config, rows: Table) -> Table:
    """By <from>_to_<to>."""
    table: Table = {}
    for before, row in rows.items():
        for after, end in row.items():  # type: ignore[attr-defined]  # a table
            table[f"{before}_to_{after}"] = {"upright": int(end["falls"] == 0)} | end
    return table


def _pushes(config: Config, rows: Table) -> Table:
    """Counts, and the largest impulse at which nobody falls, over all gaits and of each."""
    counts: dict[str, dict[str, int]] = {
        name: {f"{impulse:g}": count for impulse, count in row.items()}  # type: ignore[attr-defined]
        for name, row in rows.items()
    }
    of, table = 2 * config.pushes, dict[str, object]({"survived": counts})
    largest = {
        name: max((float(i) for i, count in row.items() if count == of), default=0.0)
        for name, row in counts.items()
    }
    most = {"max_survived_Ns": min(largest.values(), default=0.0), "by_gait_Ns": largest}
    return table | {"of": of} | most


def _energies(config: Config, rows: Table) -> Table:
    """In a second, of each gait, and the first gait's beside them."""
    first = next(iter(rows.values()), {})
    return {**rows, **first}  # type: ignore[dict-item]  # tables


SUMMARIES = {"switch": _switches, "push": _pushes, "energy": _energies}
