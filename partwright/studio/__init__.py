"""The studio: a page in the browser that sees, edits and fits an assembly, and the local server behind it."""
