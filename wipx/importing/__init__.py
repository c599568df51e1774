"""Logs in the formats of the field, turned into recordings of contract sections 1 and 6."""
