"""The paper's method, pure: no file, network, terminal, clock, environment or randomness."""
