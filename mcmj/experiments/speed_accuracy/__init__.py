"""The work-precision diagram: error against DOP853 over cost, every integrator, several bodies."""

GROUP = "speed and accuracy"
