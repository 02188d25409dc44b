"""Two robots, with the models, targets, training and measures that are particular to them."""
