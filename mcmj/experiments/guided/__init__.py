"""Guided search for settings of any experiment (Optuna).

Judged on bodies that it has not seen. Killed at any moment, the same command goes on.
"""

GROUP = "search"
EXTRA = "search"  # of pyproject.toml
