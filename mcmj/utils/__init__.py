"""What every package uses: errors, checks of arguments, random streams, files, progress, threads.

It knows nothing of bodies or of MuJoCo.
"""
