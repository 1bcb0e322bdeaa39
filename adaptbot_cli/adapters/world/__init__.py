"""Worlds outside: a simulated home, and any process that speaks the protocol (docs/worlds.md)."""
