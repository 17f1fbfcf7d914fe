"""Pure geometry: vectors, frames transported along curves, and curves given by points."""
