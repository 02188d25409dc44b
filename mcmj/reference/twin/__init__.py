"""The same steps as MuJoCo's, compiled for many small bodies at one time."""
