"""Which springs must be sensed: closed-loop error against the number of springs read."""

GROUP = "analysis"
