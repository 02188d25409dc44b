"""A robot that is its own computer: a trunk of springs on four legs of muscle learns to walk.

With no arguments: one robot, four gaits, all parts. --seeds 20 --parts: twenty robots, no parts.
"""

GROUP = "robots"
