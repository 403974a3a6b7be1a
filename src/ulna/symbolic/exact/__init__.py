"""Exact algebra: zero tests, ranks, spans and short forms over polynomial generators, each within a time budget."""
