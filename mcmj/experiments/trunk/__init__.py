"""A robot that is its own computer learns to walk.

A trunk of springs on four legs of muscle. With no arguments: one robot, four gaits, all parts.
--seeds 20 --parts: twenty robots, no parts.
"""

GROUP = "robots"
