"""Guided search for settings of any experiment (Optuna), judged on bodies it has not seen.

Killed at any moment, the same command goes on.
"""

GROUP = "search"
