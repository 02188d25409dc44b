"""The cross-entropy method learns to drive a body by its input channel, as a dm_control task."""

GROUP = "robots"
