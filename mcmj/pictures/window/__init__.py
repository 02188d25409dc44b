"""MuJoCo's interactive viewer on a closed loop."""
