"""The homes that hostile files are brought into."""

from tests.cli.conftest import home, seeded, used

__all__ = ["home", "seeded", "used"]
