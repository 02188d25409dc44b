"""Figures and films: what is shared by all experiments. Nothing here simulates or teaches."""
