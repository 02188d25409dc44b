"""A body in MuJoCo: rollouts, copies on threads, phases of an experiment, damage, interaction.

`stepsize/` predicts the largest stable step; `trajectory_files/` stores what was recorded.
"""
