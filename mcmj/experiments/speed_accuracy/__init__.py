"""Work-precision: error against DOP853 over cost.

Every integrator, several bodies.
"""

GROUP = "speed and accuracy"
