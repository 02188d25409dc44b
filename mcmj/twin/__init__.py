"""Compiled twins of MuJoCo's Euler and RK4, and the authors' scheme, for spring networks.

An independent reference for tests, and the fast way to screen bodies by the thousand.
"""
