"""Fig. 7: a taught body swings up from total rest.

With --seeds n: how many random bodies do.
"""

GROUP = "the paper"
