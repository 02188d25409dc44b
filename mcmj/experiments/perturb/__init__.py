"""Fig. 6: disturb a taught rhythm in four ways and watch it come back; noise tolerance."""

GROUP = "the paper"
