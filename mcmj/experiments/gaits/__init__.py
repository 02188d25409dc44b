"""Figs. 8 and 9: one body walks, trots, paces and bounds.

Its readout is switched, not its body. With no arguments: the body that comes with mcmj, with
its four readouts. With --seeds n: how many random bodies do it.
"""

GROUP = "the paper"
