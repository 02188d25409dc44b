"""What is taught: limit cycles, gaits, rhythms that an input drives, filters."""
