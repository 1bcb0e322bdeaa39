"""Refinement and repair: names, calls, missing steps, the check of a whole plan (paper, III-B)."""
