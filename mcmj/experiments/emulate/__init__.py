"""A nonlinear spring becomes another system by feedback.

Error and order of the static feedback, by integrator and step.
"""

GROUP = "analysis"
EXTRA = "theory"  # of pyproject.toml
