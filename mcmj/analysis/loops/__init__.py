"""Closed loops as maps of state vectors: what they are, and any reservoir as one, in MuJoCo."""
