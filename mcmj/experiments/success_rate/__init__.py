"""How many random bodies of consecutive seeds learn all three limit cycles."""

GROUP = "search"
