"""An assembly in other solids: the nearest named solid, convex pieces, bodies to collide."""
