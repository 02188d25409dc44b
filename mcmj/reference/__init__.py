"""Integrators that share no code with MuJoCo: DOP853, and compiled twins of each of its steps."""

from mcmj.reference.integration import METHODS, integrate

__all__ = ["METHODS", "integrate"]
