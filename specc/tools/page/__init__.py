"""The page: what a run does, or a recording has, in a browser of this machine."""
