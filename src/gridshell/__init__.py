"""gridshell: from a target surface to a flat grid of elastic rods that pops up into it."""
