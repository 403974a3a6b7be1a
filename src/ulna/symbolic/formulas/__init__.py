"""Formula text in and out, and LaTeX."""
