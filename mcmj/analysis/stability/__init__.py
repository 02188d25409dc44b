"""What a trained rhythm is worth: multipliers, region of attraction, tolerances.

Of a planar body many copies run in the compiled twin of MuJoCo's Euler (`loop.ClosedLoop`);
samples are repeated in MuJoCo itself (`confirm`). Of any other reservoir they run in MuJoCo
(`mcmj.analysis.loops`), by finite differences only.
"""
