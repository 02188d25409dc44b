"""The body walks: a quadruped in 3-D on its own network.

It is switched and pushed. With no arguments: the robot and the body that come with mcmj; walks,
switches and pushes. --parts adapt recover steps: the ground as a part of the computer, other time
steps.
"""

GROUP = "robots"
