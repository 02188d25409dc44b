"""Any MuJoCo model learns a rhythm, six as they are.

Four of dm_control's suite, a tensegrity and a soft arm, or a model of your own: a linear readout
of its own sensors drives its own actuators, inside MuJoCo's step.
"""

GROUP = "robots"
EXTRA = "control"  # of pyproject.toml
