"""The knowledge graph in memory, and what is judged of facts and packs."""
