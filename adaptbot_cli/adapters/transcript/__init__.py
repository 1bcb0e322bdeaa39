"""Transcripts: every turn of a run as one YAML document, to read, to replay and to resume.

A scripted transcript is the same format written by hand: it must have every plan and every answer,
and may leave out what it does not want to pin down.
"""
