"""Fig. 5: a body learns a limit cycle and runs free.

With no arguments: the general body and all three tasks of the paper.
"""

GROUP = "the paper"
