"""Which springs must be sensed.

Closed-loop error against the number of springs that the readout hears.
"""

GROUP = "analysis"
