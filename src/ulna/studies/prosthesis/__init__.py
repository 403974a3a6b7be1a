"""The prosthesis one could build: drives, loads, intent, and an honest comparison of controllers."""
