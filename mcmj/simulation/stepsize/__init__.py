"""The largest step at which an integrator is stable, from the linearised springs."""
