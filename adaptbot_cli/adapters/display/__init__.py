"""What the person sees: runs, plans, the knowledge graph; nothing here asks anything."""
