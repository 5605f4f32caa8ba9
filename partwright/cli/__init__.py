"""The command line, without logic: a file here says what a command takes, its namesake in `commands/` acts.

The files here import nothing heavy, so help, mistakes and completion are answered at once.
"""
