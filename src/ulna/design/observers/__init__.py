"""Observer forms, output transformations, and every kind of observer."""
