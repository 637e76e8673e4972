"""What a plant refuses to do."""


class PlantError(Exception):
    """A plant cannot be built, bound, driven or observed as asked.

    Attributes:
        known: the names that would have been right where a name was wrong, else empty.
        part: the joint or actuator at fault, where one is.
        device: name of the binding whose command was wrong or led there, where one was.
    """

    def __init__(
        self, message: str, known: tuple[str, ...] = (), *, part: str = "", device: str = ""
    ) -> None:
        self.known = known
        self.part = part
        self.device = device
        super().__init__(f"{message}; known: {', '.join(known)}" if known else message)
