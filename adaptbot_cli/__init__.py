"""adaptbot: an interactive tutor that turns a generic plan into one that this home can execute."""

__version__ = "0.1.0"
