"""Feedback linearisability by Lie brackets, and why arrays of linear springs need diversity."""

GROUP = "analysis"
