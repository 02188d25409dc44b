"""What a trained body's limit cycle is worth: multipliers, region of attraction, tolerances.

The many copies run in the compiled twin of MuJoCo's Euler (`mcmj.reference.twin`); samples
are repeated in MuJoCo itself (`confirm`).
"""
