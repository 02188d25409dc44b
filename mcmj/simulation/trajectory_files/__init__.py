"""Recorded trajectories as files: NPZ, Zarr, and HDF5 for OpenPRC."""
