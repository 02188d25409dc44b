"""How many random bodies learn all three limit cycles.

The same as limit_cycle --seeds 50 --free-run 60 --windows 0 --no-measure-cost.
"""

GROUP = "the paper"
