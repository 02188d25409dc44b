"""Drive a body by its input, as a dm_control task.

The cross-entropy method learns it.
"""

GROUP = "robots"
EXTRA = "control"  # of pyproject.toml
