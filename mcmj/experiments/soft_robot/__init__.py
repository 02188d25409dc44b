"""A soft robot walks in space, steered by one number.

With no arguments: one robot, four gaits, all parts. --seeds 10 --seed 100 --parts: ten robots,
no parts.
"""

GROUP = "robots"
