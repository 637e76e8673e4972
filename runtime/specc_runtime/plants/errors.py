"""What a plant refuses to do."""


class PlantError(Exception):
    """A plant cannot be built, bound, driven or observed as asked.

    Attributes:
        known: the names that would have been right where a name was wrong, else empty.
    """

    def __init__(self, message: str, known: tuple[str, ...] = ()) -> None:
        self.known = known
        super().__init__(f"{message}; known: {', '.join(known)}" if known else message)
