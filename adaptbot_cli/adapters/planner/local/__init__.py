"""The model on board: a small language model that runs in a process of its own on this machine."""
