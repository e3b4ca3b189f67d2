"""Programs that somebody would write with SimPy instead of the models beside them, each with the same metrics.

They are written as a user of SimPy would: processes and resources where they fit, closed forms where the author knows
them, the standard library's random numbers.  None of them checks anything, keeps a log, or records signals.
"""
