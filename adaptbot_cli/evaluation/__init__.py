"""The paper's experiment: three arms, linked trials, measures (docs/evaluation.md)."""
