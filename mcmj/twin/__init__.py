"""Compiled twins of MuJoCo's Euler and RK4, of the leapfrog, and of the authors' scheme.

Of spring networks: an independent reference for tests, and the fast way to screen bodies by
the thousand.
"""
