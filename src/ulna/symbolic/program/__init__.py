"""`Kernel`: expressions as one list of instructions, its transforms, and its lowerings."""
