"""Fig. 5: teach a body a limit cycle and let it run free in MuJoCo.

With no arguments: the general body and all three tasks of the paper.
"""

GROUP = "the paper"
