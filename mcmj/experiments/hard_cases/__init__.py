"""The largest stable step of every integrator on the hard cases: bisected, and predicted."""

GROUP = "speed and accuracy"
