"""What moves while the outputs are held: zero dynamics and the class of their equilibria."""
