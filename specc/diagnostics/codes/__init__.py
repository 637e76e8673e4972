"""The codes by family. A module here has `CODES`, a tuple of `Code`; it is found by being here."""
