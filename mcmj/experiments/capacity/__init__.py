"""Memory and processing capacity of a body or any model, and its ranks.

Maps of them over stiffness, damping, size and input strength.
"""

GROUP = "analysis"
