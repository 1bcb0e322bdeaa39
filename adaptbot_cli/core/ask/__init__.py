"""The person: what is asked, what an answer teaches, the conversation (paper, III-C)."""
