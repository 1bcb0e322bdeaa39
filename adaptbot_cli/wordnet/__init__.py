"""A trimmed copy of WordNet 3.0, and the script that builds it."""
