"""What springs can compute, by theory: Lie brackets, arrays of springs, emulation.

`stability/` judges what was learned.
"""
