"""The workspace's files and their versions: Turtle that git reads well, written all or nothing."""
