"""A target as a constraint on nodes or as a contact energy, in statics (`static`) and in time (`modified_mass`)."""
