"""A report card of a trained body.

Errors, Floquet multipliers, region of attraction, tolerances. With no arguments: the general
body, taught Van der Pol.
"""

GROUP = "analysis"
