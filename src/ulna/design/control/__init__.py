"""Gains, references, laws, compensators and the loops they close."""
