"""The largest stable step of every integrator.

On the hard cases, bisected, beside its prediction.
"""

GROUP = "speed and accuracy"
