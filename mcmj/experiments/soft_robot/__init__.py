"""A soft robot in three dimensions walks: springs, muscles, gravity, ground, and nothing else.

With no arguments: one robot, four gaits, all parts. --seeds 10 --seed 100 --parts: ten robots,
no parts.
"""

GROUP = "robots"
