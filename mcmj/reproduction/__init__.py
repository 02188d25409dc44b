"""The paper's claims, run and compared: what to run, what came out, one page."""
