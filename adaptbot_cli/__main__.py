"""`python -m adaptbot_cli` is the command `adaptbot`."""

from adaptbot_cli.cli.main import main

main()
