"""What models learned: orbits, and errors over the seeds."""

from contextlib import suppress
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mcmj.experiments.adopt.result import RUNS, Adopted, Result
from mcmj.pictures.film import ModelFilm
from mcmj.pictures.model_view import BAND, ModelView
from mcmj.pictures.opengl import RenderingUnavailableError
from mcmj.pictures.plotting import count_in_whole_numbers, draw_phase_plane, new_figure
from mcmj.pictures.rendering import ORBIT_POINTS
from mcmj.utils.colours import BLACK, BLUE, GREEN, ORANGE, RED

STYLES = {
    "free": ("on from the teaching", BLACK, "o"),
    "from_rest": ("from rest", BLUE, "s"),
    "after_freeze": ("an output was held", GREEN, "^"),
    "after_kick": ("after a kick", ORANGE, "v"),
}
PICTURE = (480, 360)  # pixels of a model
WORST = 3.0  # errors above it, and blow-ups, are drawn here


def figures(result: Result) -> dict[str, Figure]:
    """By file name; without OpenGL the models are not shown."""
    found = {"adopt": adopt_figure(result)}
    with suppress(RenderingUnavailableError):
        found["adopt_models"] = models_figure(result)
    return found


def models_figure(result: Result) -> Figure:
    """The models at work.

    Raises:
        RenderingUnavailableError: there is no OpenGL.
    """
    films = {name: film_of(one) for name, one in result.adopted.items() if one.motion is not None}
    columns = min(3, max(1, len(films)))
    rows = max(1, -(-len(films) // columns))
    figure = new_figure(3.4 * columns, 2.7 * rows)
    axes = figure.subplots(rows, columns, squeeze=False)
    for one in axes.flat:
        one.set_axis_off()
    for place, (name, film) in zip(axes.flat, films.items(), strict=False):
        with ModelView(film, PICTURE[0], PICTURE[1] + 2 * BAND) as view:
            place.imshow(view.draw(len(film.times) // 2)[BAND:-BAND].copy())
        place.set_title(Path(name).stem)
    return figure


def film_of(one: Adopted) -> ModelFilm:
    """The end of a model's free run."""
    assert one.motion is not None
    return ModelFilm(
        one.reservoir.model, one.motion.times, one.motion.qpos, one.motion.outputs,
        one.target.orbit(ORBIT_POINTS),
    )  # fmt: skip


def adopt_figure(result: Result) -> Figure:
    """Phase portraits above, errors over the seeds below, a column a model."""
    count = len(result.adopted)
    figure = new_figure(max(5.0, 3.0 * count), 6.2)
    axes = figure.subplots(2, count, squeeze=False, height_ratios=(1.0, 0.9))
    for column, (name, one) in enumerate(result.adopted.items()):
        _draw_orbit(axes[0, column], name, one)
        _draw_errors(axes[1, column], one, result.config.threshold)
    for row in axes:
        for inner in row[1:]:
            inner.set_ylabel("")
    handles, labels = axes[1, 0].get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside lower center", ncols=5 if count > 2 else 2, frameon=False
    )
    return figure


def _draw_orbit(axes: Axes, name: str, one: Adopted) -> None:
    if one.motion is not None:
        draw_phase_plane(axes, one.motion.outputs, one.target)
    axes.set_title(f"{name}: {one.reservoir.n_signals} signals\nperiod {one.target.period:.2f} s")


def _draw_errors(axes: Axes, one: Adopted, threshold: float) -> None:
    seeds = np.array([trial.seed for trial in one.trials])
    for place, run in enumerate(RUNS):
        label, colour, mark = STYLES[run]
        errors = 100 * np.minimum(one.errors(run), WORST)
        axes.semilogy(seeds + 0.15 * (place - 1.5), errors, mark, color=colour, ms=4, label=label)
    axes.axhline(100 * threshold, color=RED, ls=":", lw=1, label=f"{100 * threshold:g} %")
    axes.set(xlabel="seed of the teacher noise", ylabel="orbit error [%]")
    axes.set_ylim(0.1, 120 * WORST)
    count_in_whole_numbers(axes)
