"""What was asked: a person's words, read."""
