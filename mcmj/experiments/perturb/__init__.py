"""Fig. 6: a taught rhythm is disturbed and comes back.

Four disturbances, and the tolerance of noise.
"""

GROUP = "the paper"
