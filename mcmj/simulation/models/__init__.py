"""Any MuJoCo model with sensors and channels added: names, engine, file."""
