"""How many random bodies learn all three limit cycles.

Bodies of consecutive seeds.
"""

GROUP = "search"
