"""How a form is made: layers, cut lengths, splices, stock, bracing."""
