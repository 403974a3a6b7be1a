"""The only callers of the computer algebra, in rooms, each with a front of its own from which other packages import.

`formulas` (text in and out), `exact` (zero tests, ranks, short forms, time budgets), `solving` (roots, inverse maps),
`integration` (of one-forms), `compiling` (expressions to a `Kernel`).
"""
