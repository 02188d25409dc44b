"""Feedback linearisability, and why springs must differ.

Lie brackets in closed form; arrays of linear springs from diverse to equal.
"""

GROUP = "analysis"
EXTRA = "theory"  # of pyproject.toml
