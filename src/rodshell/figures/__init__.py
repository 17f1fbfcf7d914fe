"""What is said of a form: records of figures, each with its meaning and its unit, as they stand in result.json."""
