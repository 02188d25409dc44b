"""One experiment a module: a frozen Config, and run(config) -> Result."""
