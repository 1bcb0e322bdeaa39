"""`adaptbot eval`: experiments."""
