"""Complete runs on real input: the paper, equation by equation."""
