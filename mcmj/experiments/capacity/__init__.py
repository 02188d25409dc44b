"""Memory, processing capacity, ranks of a body or any model.

Maps of them over stiffness, damping, size and input strength.
"""

GROUP = "analysis"
