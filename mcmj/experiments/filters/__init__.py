"""Filters without feedback, and a switch that needs it.

The body against regression on the input without a body.
"""

GROUP = "the paper"
