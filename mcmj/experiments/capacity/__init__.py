"""Memory and processing capacity, kernel and generalisation rank of a body; maps of them."""

GROUP = "analysis"
