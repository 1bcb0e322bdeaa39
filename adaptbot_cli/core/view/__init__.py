"""What people read: things, changes, origins, results, progress lines."""
