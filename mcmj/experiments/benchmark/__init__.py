"""Measure every speed claim of mcmj on this machine: ratios, medians, side by side."""

GROUP = "speed and accuracy"
