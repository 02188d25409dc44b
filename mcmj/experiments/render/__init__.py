"""A film of a body at work: MP4, GIF and PNG.

From a body file, or from a trajectory file. With no arguments: the body "quadratic",
undisturbed. For Fig. 6 of the paper as a film: --freeze 1.
"""

GROUP = "pictures"
