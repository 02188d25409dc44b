"""Everything in the paper, as one page.

Every claim with ours beside it, every figure. The full mode takes long; --quick a minute or a
few, with fewer bodies. Interrupted or stopped by an error, the same command goes on with what is
not finished.
"""

GROUP = "the paper"
