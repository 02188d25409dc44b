"""Search over bodies and settings of any experiment.

Screened with the twin, confirmed in MuJoCo. Killed at any moment, the same command goes on:
finished trials are in the store. Example: mcmj search --seeds 100 --set task=quadratic
--vary 'noise=log(0.02,1,6)'
"""

GROUP = "search"
EXTRA = "search"  # of pyproject.toml
