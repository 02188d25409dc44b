"""Open-loop filters against regression without a body, and a switch that needs feedback."""

GROUP = "the paper"
