"""The command line: one file a command, no logic. Everything heavy is imported when a command runs."""
