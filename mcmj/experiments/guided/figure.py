"""A guided search: what was tried, and how the best does on other bodies."""

import numpy as np
from matplotlib.figure import Figure

from mcmj.experiments.guided.result import Result
from mcmj.experiments.search.figure import draw_scores
from mcmj.pictures.plotting import count_in_whole_numbers, new_figure


def figures(result: Result) -> dict[str, Figure]:
    """By file name."""
    return {"guided": guided_figure(result)}


def guided_figure(result: Result) -> Figure:
    """The objective of every setting tried and the best so far; scores on other bodies."""
    config = result.config
    figure = new_figure(11.0, 4.0)
    left, right = figure.subplots(1, 2)
    values = np.array([objective for _, objective in result.tried])
    number = np.arange(1, len(values) + 1)
    so_far = (np.maximum if config.large_is_good else np.minimum).accumulate(values)
    left.plot(number, values, ".", color="0.5", label="a setting")
    left.step(number, so_far, where="post", color="black", lw=1.4, label="best so far")
    count_in_whole_numbers(left)
    left.set(xlabel="settings tried", ylabel=f"objective ({config.objective})")
    left.grid(alpha=0.3)
    left.legend(frameon=False)
    draw_scores(right, result.judged, config.target)
    right.set_title("on bodies that the search has not seen")
    return figure
