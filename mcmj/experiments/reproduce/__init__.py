"""Everything in the paper: every claim with ours beside it, every figure, as one page.

The full mode takes long; --quick a minute or a few, with fewer bodies. Interrupted or stopped
by an error, the same command goes on with what is not finished.
"""

GROUP = "the paper"
