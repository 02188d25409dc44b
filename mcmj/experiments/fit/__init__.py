"""Fit a readout to signals that a lab recorded.

Lengths that a camera or sensors measured on a real body, and what it should have said: a linear
readout is trained on the first part and tested on the last. With the inputs that drove the body
its memory and processing capacity too. No simulation.
"""

GROUP = "analysis"
