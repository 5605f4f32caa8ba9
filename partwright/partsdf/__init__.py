"""Method 3, PartSDF: a learned prior over shapes made of parts (Talabot et al. 2025)."""
