"""Training a readout: regression, teacher forcing, practice in closed loop, settings chosen by it.

`environments/` are bodies as tasks of dm_control and Gymnasium.
"""
