"""Search bodies and settings of any experiment: screened with the twin, confirmed in MuJoCo.

Killed at any moment, the same command goes on: finished trials are in the store. Example:
search.py --seeds 100 --set task=quadratic --vary 'teaching.noise=log(0.02,1,6)'
"""

GROUP = "search"
