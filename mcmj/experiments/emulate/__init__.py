"""A nonlinear spring becomes another system by static feedback: error and order by integrator."""

GROUP = "analysis"
