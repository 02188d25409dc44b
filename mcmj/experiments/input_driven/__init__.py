"""Figs. 10 and 11: the input chooses a body's rhythm. With --seeds n: how many bodies learn it."""

GROUP = "the paper"
