"""What springs can compute, by theory (Lie brackets, arrays, emulation); `stability/` of what was learned."""
