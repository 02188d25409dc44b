"""Memory and processing capacity of a body, and its ranks.

Maps of them over stiffness, damping, size and input strength.
"""

GROUP = "analysis"
