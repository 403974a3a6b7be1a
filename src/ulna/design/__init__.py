"""Forms, laws, observers, compensators and closed loops: from a plant's geometry to its controller."""
