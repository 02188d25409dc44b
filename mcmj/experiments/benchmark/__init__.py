"""Every speed claim of mcmj, measured on this machine.

Ratios are medians, measured side by side.
"""

GROUP = "speed and accuracy"
EXTRA = "control"  # of pyproject.toml
