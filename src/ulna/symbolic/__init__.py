"""The only callers of the computer algebra: reading, zero and rank tests, inversion, and `Kernel` with its lowerings."""
