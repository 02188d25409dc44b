"""Integrators that share no code with MuJoCo: DOP853, and the compiled twin of each of its steps."""
