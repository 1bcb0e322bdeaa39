"""One module or package for each outside thing; they never import each other."""
