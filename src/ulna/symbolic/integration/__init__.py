"""One-forms integrated: potentials, integrating factors, Pfaffian equations."""
