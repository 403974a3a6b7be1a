"""The only callers of the computer algebra: reading, zero and rank tests, inversion, `Kernel` and its lowerings."""
