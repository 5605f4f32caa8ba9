"""The objectives that ship, a file each."""
