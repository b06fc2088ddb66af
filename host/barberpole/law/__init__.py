"""The published algebra of the AMR bridge (thesis chapters 3 and 5), for reproduction and teaching.

What fits and compensates is in `barberpole.effects`, which solves the film's law exactly; here stand the formulas as
they are printed, with their approximations.
"""
