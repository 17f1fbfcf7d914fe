"""Loads and their combinations, and what a shell does under them."""
