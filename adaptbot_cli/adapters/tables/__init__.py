"""Tables of the knowledge graph for the terminal: things, changes, where facts come from."""
