"""Figs. 10 and 11: an input chooses the rhythm of a body.

With --seeds n: how many bodies learn it.
"""

GROUP = "the paper"
