"""Bodies made to measure: springs that learn a task.

From a random body that fails, CMA-ES looks for one that learns by teacher forcing and finds its
rhythm from total rest, whatever the noise. Killed at any moment, the same command goes on.
"""

GROUP = "search"
EXTRA = "design"  # of pyproject.toml
