"""The studio: a live page on which a gridshell is designed. Needs `pip install "rodshell[studio]"`."""
