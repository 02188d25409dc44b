"""One folder an experiment: config, run, figure, command. `mcmj NAME` runs it."""
