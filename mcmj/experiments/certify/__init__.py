"""Report card of a trained body: errors, Floquet multipliers, region of attraction, tolerances.

With no arguments: the general body, taught Van der Pol.
"""

GROUP = "analysis"
