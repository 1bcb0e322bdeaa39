"""Where plans come from: the plan library, or a model."""
